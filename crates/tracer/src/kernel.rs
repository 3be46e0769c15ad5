//! One traversal compiled for several instruction sets, and the choice between them: the only unsafe code of
//! this crate.
#![allow(unsafe_code)]

use crate::scene::Scene;
#[cfg(target_arch = "x86_64")]
use crate::simd::avx2::Avx2;
use crate::simd::portable::Portable;
use crate::traverse::{Stacks, trace};
use raystrips_geom::{Hit, Ray};

/// Instructions that a tracer uses. All give the same bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kernel {
    /// What every processor of the architecture has.
    Portable,
    /// x86-64 with AVX2: eight lanes.
    Avx2,
}

impl Kernel {
    /// The fastest that this processor has.
    pub fn best() -> Kernel {
        *Kernel::available().last().expect("the portable kernel is always there")
    }

    /// All that this processor has, the slowest first.
    pub fn available() -> &'static [Kernel] {
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") {
            return &[Kernel::Portable, Kernel::Avx2];
        }
        &[Kernel::Portable]
    }

    /// Name as in reports.
    pub fn name(self) -> &'static str {
        match self {
            Kernel::Portable => "portable",
            Kernel::Avx2 => "avx2",
        }
    }
}

/// Traces rays through a scene. Holds the memory of the traversal: one for each thread.
pub struct Tracer<'s> {
    scene: &'s Scene,
    kernel: Kernel,
    stacks: Stacks,
}

impl<'s> Tracer<'s> {
    /// A tracer with the fastest kernel of this processor.
    pub fn new(scene: &'s Scene) -> Tracer<'s> {
        Tracer::with_kernel(scene, Kernel::best())
    }

    /// A tracer with the given kernel.
    ///
    /// # Panics
    /// If this processor does not have it.
    pub fn with_kernel(scene: &'s Scene, kernel: Kernel) -> Tracer<'s> {
        assert!(Kernel::available().contains(&kernel), "this processor lacks {}", kernel.name());
        Tracer { scene, kernel, stacks: Stacks::for_scene(scene) }
    }

    /// Closest hit: the triangle with the least `tnear <= t <= tfar`, the first in the pack of several at the
    /// same distance; [`Hit::MISS`] if there is none. Both faces are hit. Rays that are not
    /// [valid](Ray::is_valid) miss.
    #[inline]
    pub fn intersect(&mut self, ray: &Ray) -> Hit {
        self.trace::<false>(ray)
    }

    /// Any hit: whether a triangle lies between `tnear` and `tfar`.
    #[inline]
    pub fn occluded(&mut self, ray: &Ray) -> bool {
        self.trace::<true>(ray).is_hit()
    }

    #[inline]
    fn trace<const ANY: bool>(&mut self, ray: &Ray) -> Hit {
        if !ray.is_valid() {
            return Hit::MISS;
        }
        match self.kernel {
            Kernel::Portable => trace::<_, ANY>(Portable, self.scene, &mut self.stacks, ray),
            #[cfg(target_arch = "x86_64")]
            // SAFETY: the constructor made sure that the processor has AVX2.
            Kernel::Avx2 => unsafe { trace_avx2::<ANY>(self.scene, &mut self.stacks, ray) },
            #[cfg(not(target_arch = "x86_64"))]
            Kernel::Avx2 => unreachable!("the constructor refuses kernels of other processors"),
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn trace_avx2<const ANY: bool>(scene: &Scene, stacks: &mut Stacks, ray: &Ray) -> Hit {
    // SAFETY: this function is only called where there is AVX2.
    trace::<_, ANY>(unsafe { Avx2::assume() }, scene, stacks, ray)
}
