//! One tracer compiled for several instruction sets, and the choice between them: the only unsafe code of this
//! crate beside that of the instruction sets themselves.
#![allow(unsafe_code)]

use crate::packet::{PACKET, Packet};
use crate::pages::Pages;
use crate::rays::{Cursor, Parked, RayBuffer};
use crate::scene::Scene;
use crate::simd::Simd;
#[cfg(target_arch = "x86_64")]
use crate::simd::avx2::Avx2;
use crate::simd::portable::Portable;
use crate::stream::{Jobs, Start, Stopped, WALKS, trace_stream};
use crate::walk::Walk;
use raystrips_geom::{Hit, Ray};
use raystrips_pack::PageId;
use raystrips_paging::Visit;

/// Instructions that a tracer uses. All give the same bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kernel {
    /// What every processor of the architecture has.
    Portable,
    /// x86-64 with AVX2 and FMA: eight lanes.
    Avx2,
    /// The same operations on x86-64 with AVX-512, whose masks and twice as many registers make them shorter.
    Avx512,
}

impl Kernel {
    /// The fastest that this processor has.
    pub fn best() -> Kernel {
        *Kernel::available().last().expect("the portable kernel is always there")
    }

    /// All that this processor has, the slowest first.
    pub fn available() -> &'static [Kernel] {
        #[cfg(target_arch = "x86_64")]
        {
            use std::arch::is_x86_feature_detected as has;
            let has_avx2 = has!("avx2")
                && has!("fma")
                && has!("popcnt")
                && has!("bmi1")
                && has!("bmi2")
                && has!("lzcnt");
            let has_avx512 = has!("avx512f") && has!("avx512vl") && has!("avx512bw") && has!("avx512dq");
            if has_avx2 && has_avx512 {
                return &[Kernel::Portable, Kernel::Avx2, Kernel::Avx512];
            }
            if has_avx2 {
                return &[Kernel::Portable, Kernel::Avx2];
            }
        }
        &[Kernel::Portable]
    }

    /// Name as in reports.
    pub fn name(self) -> &'static str {
        match self {
            Kernel::Portable => "portable",
            Kernel::Avx2 => "avx2",
            Kernel::Avx512 => "avx512",
        }
    }
}

/// Traces rays through a scene. Holds the memory of the traversal: one for each thread.
pub struct Tracer<'s> {
    scene: &'s Scene,
    kernel: Kernel,
    closest: Walks<'s, false>,
    any: Walks<'s, true>,
    packet: Packet,
}

const ALL_IN_MEMORY: &str = "all pages of a scene are in memory";

/// Rays under way: half a megabyte, made when it is first needed.
struct Walks<'s, const ANY: bool>(Option<Box<[Walk<'s, ANY>; WALKS]>>);

impl<'s, const ANY: bool> Walks<'s, ANY> {
    #[inline]
    fn get(&mut self, pages: impl Pages<'s>) -> &mut [Walk<'s, ANY>; WALKS] {
        self.0.get_or_insert_with(|| {
            let walks: Vec<Walk<'s, ANY>> = (0..WALKS).map(|_| Walk::idle(pages)).collect();
            walks.into_boxed_slice().try_into().unwrap_or_else(|_| unreachable!("as many as were made"))
        })
    }
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
        Tracer { scene, kernel, closest: Walks(None), any: Walks(None), packet: Packet::new() }
    }

    pub(crate) fn scene(&self) -> &'s Scene {
        self.scene
    }

    /// Closest hit: the triangle with the least `tnear <= t <= tfar`, the first in the pack of several at the
    /// same distance; [`Hit::MISS`] if there is none. Both faces are hit. Rays that are not
    /// [valid](Ray::is_valid) miss.
    pub fn intersect(&mut self, ray: &Ray) -> Hit {
        single(self.kernel, self.scene, &mut self.closest.get(self.scene)[0], ray)
    }

    /// Any hit: whether a triangle lies between `tnear` and `tfar`.
    pub fn occluded(&mut self, ray: &Ray) -> bool {
        single(self.kernel, self.scene, &mut self.any.get(self.scene)[0], ray).is_hit()
    }

    /// Closest hits of `rays`, `hits[i]` for `rays[i]`: the same as one by one, and faster from some dozen rays on.
    ///
    /// # Panics
    /// If the lengths differ.
    pub fn intersect_batch(&mut self, rays: &[Ray], hits: &mut [Hit]) {
        assert_eq!(rays.len(), hits.len());
        let mut jobs = Batch::new(rays, |i, hit| hits[i] = hit);
        stream(self.kernel, self.scene, self.closest.get(self.scene), &mut jobs);
    }

    /// Whether something lies on each of `rays`, `occluded[i]` for `rays[i]`.
    ///
    /// # Panics
    /// If the lengths differ.
    pub fn occluded_batch(&mut self, rays: &[Ray], occluded: &mut [bool]) {
        assert_eq!(rays.len(), occluded.len());
        let mut jobs = Batch::new(rays, |i, hit: Hit| occluded[i] = hit.is_hit());
        stream(self.kernel, self.scene, self.any.get(self.scene), &mut jobs);
    }

    /// Closest hits of rays that keep together, such as the camera rays of a block of pixels: up to 64 of them from
    /// one origin are traced as one; more are cut into such packets. The hits are the same as one by one, and of
    /// rays that do not keep together are found that way.
    ///
    /// # Panics
    /// If the lengths differ.
    pub fn intersect_packet(&mut self, rays: &[Ray], hits: &mut [Hit]) {
        assert_eq!(rays.len(), hits.len());
        for (rays, hits) in rays.chunks(PACKET).zip(hits.chunks_mut(PACKET)) {
            let Tracer { scene, kernel, closest, packet: memory, .. } = self;
            let outcome = packet(*kernel, scene, memory, &mut closest.get(*scene)[0], rays, hits);
            if !outcome.expect(ALL_IN_MEMORY) {
                self.intersect_batch(rays, hits);
            }
        }
    }
}

/// Rays of a slice, of which those that cannot be traced miss.
struct Batch<'r, D> {
    rays: std::iter::Enumerate<std::slice::Iter<'r, Ray>>,
    done: D,
}

impl<'r, D: FnMut(usize, Hit)> Batch<'r, D> {
    fn new(rays: &'r [Ray], done: D) -> Batch<'r, D> {
        Batch { rays: rays.iter().enumerate(), done }
    }
}

impl<D: FnMut(usize, Hit)> Jobs for Batch<'_, D> {
    #[inline]
    fn next(&mut self) -> Option<(usize, Start<'_>)> {
        loop {
            match self.rays.next()? {
                (number, ray) if !ray.is_valid() => (self.done)(number, Hit::MISS),
                (number, ray) => return Some((number, Start::Ray(ray))),
            }
        }
    }

    #[inline]
    fn done(&mut self, number: usize, hit: Hit) {
        (self.done)(number, hit);
    }

    fn set_aside(&mut self, _: usize, Stopped { page, .. }: Stopped) {
        unreachable!("page {page}: {ALL_IN_MEMORY}")
    }
}

/// Gets a ray and the page that it waits for.
pub type SetAside<'a, E> = dyn FnMut(PageId, Parked<E>) + 'a;

/// Traces rays through the pages that a visit finds in memory; sets aside those that need others.
pub struct VisitTracer<'v> {
    visit: &'v Visit<'v>,
    kernel: Kernel,
    closest: Walks<'v, false>,
    any: Walks<'v, true>,
    packet: Packet,
}

impl<'v> VisitTracer<'v> {
    /// A tracer with the fastest kernel of this processor.
    pub fn new(visit: &'v Visit<'v>) -> VisitTracer<'v> {
        let kernel = Kernel::best();
        VisitTracer { visit, kernel, closest: Walks(None), any: Walks(None), packet: Packet::new() }
    }

    /// Closest hits, as [`Tracer::intersect`] finds them.
    pub fn intersect<E: Copy>(&mut self, mut rays: Buffered<E>) {
        visiting_stream(self.kernel, self.visit, self.closest.get(self.visit), &mut rays);
    }

    /// Closest hits of up to [`PACKET`] rays that keep together. False, and nothing done, where they do not.
    ///
    /// # Errors
    /// A page that they need and that is not in memory; nothing is known of any hit then.
    ///
    /// # Panics
    /// If the lengths differ.
    pub fn intersect_packet(&mut self, rays: &[Ray], hits: &mut [Hit]) -> Result<bool, PageId> {
        assert_eq!(rays.len(), hits.len());
        let single = &mut self.closest.get(self.visit)[0];
        visiting_packet(self.kernel, self.visit, &mut self.packet, single, rays, hits)
    }

    /// Any hits.
    pub fn occluded<E: Copy>(&mut self, mut rays: Buffered<E>) {
        visiting_stream(self.kernel, self.visit, self.any.get(self.visit), &mut rays);
    }
}

/// Rays of a buffer to be traced, and who gets what becomes of them.
pub struct Buffered<'a, E> {
    /// The buffer.
    pub rays: &'a RayBuffer<E>,
    /// Where to begin; afterwards behind the last ray that was traced.
    pub cursor: &'a mut Cursor,
    /// How many at most.
    pub most: usize,
    /// Gets errand, ray and hit of those that come to their end, in any order.
    pub done: &'a mut dyn FnMut(E, Ray, Hit),
    /// Gets each of the others with the page that it waits for.
    pub aside: &'a mut SetAside<'a, E>,
}

impl<E: Copy> Jobs for Buffered<'_, E> {
    fn next(&mut self) -> Option<(usize, Start<'_>)> {
        while self.most > 0 {
            self.most -= 1;
            let (errand, waiting) = self.rays.take_next(self.cursor)?;
            if waiting.ray.is_valid() {
                return Some((self.cursor.next - 1, Start::Waiting(waiting)));
            }
            (self.done)(errand, *waiting.ray, Hit::MISS);
        }
        None
    }

    fn done(&mut self, number: usize, hit: Hit) {
        let (errand, ray) = self.rays.ray(number);
        (self.done)(errand, ray, hit);
    }

    fn set_aside(&mut self, number: usize, Stopped { page, place }: Stopped) {
        let (errand, ray) = self.rays.ray(number);
        (self.aside)(page, Parked { errand, ray, place });
    }
}

/// A function that is compiled for each kernel from one that takes the instructions as its first argument.
macro_rules! for_each_kernel {
    ($(fn $name:ident<$s:lifetime $(, const $any:ident: bool)?>($($arg:ident: $type:ty),*) -> $result:ty = $generic:path;)*) => {$(
        fn $name<$s $(, const $any: bool)?>(kernel: Kernel, $($arg: $type),*) -> $result {
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx2,fma,popcnt,bmi1,bmi2,lzcnt")]
            fn avx2<$s $(, const $any: bool)?>($($arg: $type),*) -> $result {
                // SAFETY: this function is only called where there are AVX2 and FMA.
                $generic(unsafe { Avx2::assume() }, $($arg),*)
            }
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx2,fma,popcnt,bmi1,bmi2,lzcnt,avx512f,avx512vl,avx512bw,avx512dq")]
            fn avx512<$s $(, const $any: bool)?>($($arg: $type),*) -> $result {
                // SAFETY: this function is only called where there are AVX2 and FMA.
                $generic(unsafe { Avx2::assume() }, $($arg),*)
            }
            match kernel {
                Kernel::Portable => $generic(Portable, $($arg),*),
                // SAFETY: the constructor of a tracer made sure that the processor has these instructions.
                #[cfg(target_arch = "x86_64")]
                Kernel::Avx2 => unsafe { avx2($($arg),*) },
                // SAFETY: as above.
                #[cfg(target_arch = "x86_64")]
                Kernel::Avx512 => unsafe { avx512($($arg),*) },
                #[cfg(not(target_arch = "x86_64"))]
                _ => unreachable!("the constructor refuses kernels of other processors"),
            }
        }
    )*};
}

for_each_kernel! {
    fn single<'s, const ANY: bool>(scene: &'s Scene, walk: &mut Walk<'s, ANY>, ray: &Ray) -> Hit = trace_single;
    fn stream<'s, const ANY: bool>(
        scene: &'s Scene, walks: &mut [Walk<'s, ANY>; WALKS], jobs: &mut dyn Jobs
    ) -> () = trace_stream;
    fn visiting_stream<'s, const ANY: bool>(
        visit: &'s Visit<'s>, walks: &mut [Walk<'s, ANY>; WALKS], jobs: &mut dyn Jobs
    ) -> () = trace_stream;
    fn packet<'s>(
        scene: &'s Scene, packet: &mut Packet, single: &mut Walk<'s, false>, rays: &[Ray], hits: &mut [Hit]
    ) -> Result<bool, PageId> = Packet::trace;
    fn visiting_packet<'s>(
        visit: &'s Visit<'s>, packet: &mut Packet, single: &mut Walk<'s, false>, rays: &[Ray], hits: &mut [Hit]
    ) -> Result<bool, PageId> = Packet::trace;
}

#[inline(always)]
fn trace_single<'s, S: Simd, const ANY: bool>(
    s: S,
    scene: &'s Scene,
    walk: &mut Walk<'s, ANY>,
    ray: &Ray,
) -> Hit {
    if !ray.is_valid() {
        return Hit::MISS;
    }
    walk.begin(s, scene, ray);
    walk.finish(s, scene).expect(ALL_IN_MEMORY);
    walk.hit()
}
