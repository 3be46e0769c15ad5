//! Makes the [code](crate::strand_code) of a cluster of strands.

use crate::layout::{GeometryRun, MAX_CLUSTER_VERTICES};
use crate::strand_code::{FIELDS, Point, StrandCode, Widths};
use crate::strand_record::{STRAND_RECORD_BYTES, StrandView};
use crate::vertices::VertexCode;
use glam::Vec3;
use raystrips_geom::strand::WINDOW_SEGMENTS;
use std::ops::Range;

/// A window of a strand to be stored.
#[derive(Clone, Copy, Debug)]
pub struct StrandParts<'a> {
    /// Vertices of the cluster that follow each other.
    pub refs: &'a [u8],
    /// Codes of the radii there.
    pub radii: &'a [u8],
    /// Geometry of all of it.
    pub geometry: u32,
}

/// A cluster of strands as it is stored.
pub struct StoredStrands {
    pub(crate) code: VertexCode,
    /// Each window, in the order in which they were given.
    pub(crate) windows: Vec<StrandView>,
    /// The code of strands, then the pairs.
    pub(crate) bytes: Vec<u8>,
    pub(crate) runs: Vec<GeometryRun>,
}

impl StoredStrands {
    /// The shortest that windows over `vertices` can be.
    ///
    /// # Panics
    /// If there is no window or too many, or one has no or too many segments.
    pub fn of(vertices: &[Vec3], parts: &[StrandParts]) -> StoredStrands {
        assert!(
            (1..=MAX_CLUSTER_VERTICES).contains(&vertices.len()),
            "{} vertices in a cluster",
            vertices.len()
        );
        let pairs = StrandPairs::of(vertices, parts);
        let runs = GeometryRun::of(parts.iter().map(|part| (part.geometry, part.refs.len() - 1)));
        StoredStrands { code: pairs.code, bytes: pairs.bytes(), windows: pairs.windows, runs }
    }

    /// Bytes in a page, but for the runs of geometries.
    pub fn byte_count(&self) -> usize {
        self.bytes.len() + STRAND_RECORD_BYTES * self.windows.len()
    }
}

struct StrandPairs {
    code: VertexCode,
    strand_code: StrandCode,
    windows: Vec<StrandView>,
    /// Window by window, from the middle of its pair on.
    points: Vec<Point>,
    pairs: Vec<Pair>,
}

/// The points of a pair after its middle and before it; each begins with the middle. There may be none before it.
type Pair = [Range<usize>; 2];

impl StrandPairs {
    fn of(vertices: &[Vec3], parts: &[StrandParts]) -> StrandPairs {
        let (sides, windows) = pair_up(parts);
        let middles = sides.iter().map(|[after, _]| vertices[usize::from(parts[*after].refs[0])]);
        let code = VertexCode { last: (sides.len() - 1) as u8, ..VertexCode::of(vertices).narrowed(middles) };
        let numbers: Vec<[u32; 3]> = vertices.iter().map(|&vertex| code.numbers(vertex)).collect();
        let mut points = Vec::with_capacity(2 * vertices.len());
        let mut side = |part: Option<&StrandParts>, is_backward: bool| {
            let begin = points.len();
            let part = part.map(|part| part.refs.iter().zip(part.radii)).into_iter().flatten();
            points.extend(part.map(|(&vertex, &radius)| {
                let [x, y, z] = numbers[usize::from(vertex)];
                [x, y, z, u32::from(radius)]
            }));
            if is_backward {
                points[begin..].reverse();
            }
            begin..points.len()
        };
        let pairs: Vec<Pair> = sides
            .iter()
            .map(|&[after, before]| [side(parts.get(after), false), side(parts.get(before), true)])
            .collect();
        let codes = strand_codes(&points, &pairs);
        let shortest = codes.into_iter().min_by_key(|strand_code| strand_code.pair_bytes(&code));
        let strand_code = shortest.expect("one of three");
        let code = VertexCode { stride: strand_code.pair_bytes(&code) as u8, ..code };
        StrandPairs { code, strand_code, windows, points, pairs }
    }

    /// The code and the pairs.
    fn bytes(&self) -> Vec<u8> {
        let count = size_of::<StrandCode>() + self.pairs.len() * usize::from(self.code.stride);
        let mut out = Vec::with_capacity(count);
        out.extend_from_slice(bytemuck::bytes_of(&self.strand_code));
        self.pairs.iter().for_each(|pair| self.write_pair(pair, &mut out));
        out
    }

    fn write_pair(&self, pair: &Pair, out: &mut Vec<u8>) {
        let StrandCode { order, step: step_bits, bend: bend_bits, rest: rest_bits, .. } = self.strand_code;
        let sides = pair.clone().map(|side| &self.points[side]);
        let (step, bend) = step_and_bend(sides, order);
        let [x, y, z, radius] = sides[0][0];
        let middle = [x, y, z, radius - u32::from(self.strand_code.radius_anchor)];
        let end = out.len() + usize::from(self.code.stride);
        let mut bits = BitWriter { begin: out.len(), bits: 0, bytes: out };
        bits.push(middle, &self.strand_code.middle(&self.code));
        bits.push(step, &step_bits);
        bits.push(bend, &bend_bits);
        for (side, reach) in sides.into_iter().zip(self.strand_code.reach) {
            // Shorter windows than the longest are filled up.
            let rests = rests(side, bend).map(|rests| rests[usize::from(order) - 1]);
            let rests = rests.chain(std::iter::repeat([0; FIELDS]));
            rests.take(usize::from(reach).saturating_sub(1)).for_each(|rest| bits.push(rest, &rest_bits));
        }
        out.resize(end, 0);
    }
}

/// Joins windows that follow each other. Gives for each pair the numbers of the windows after and before its middle,
/// [`usize::MAX`] where there is none, and where each window is.
fn pair_up(parts: &[StrandParts]) -> (Vec<[usize; 2]>, Vec<StrandView>) {
    let mut order: Vec<usize> = (0..parts.len()).collect();
    order.sort_by_key(|&i| parts[i].refs[0]);
    let mut pairs: Vec<[usize; 2]> = Vec::new();
    let mut windows = vec![StrandView { segments: 0, pair: 0, is_backward: false }; parts.len()];
    for i in order {
        let segments = parts[i].refs.len() - 1;
        assert!((1..=WINDOW_SEGMENTS).contains(&segments), "{segments} segments in a window");
        assert_eq!(parts[i].refs.len(), parts[i].radii.len());
        match pairs.last_mut() {
            Some([last, before @ usize::MAX]) if parts[*last].refs.last() == parts[i].refs.first() => {
                windows[*last].is_backward = true;
                (*last, *before) = (i, *last);
            }
            _ => pairs.push([i, usize::MAX]),
        }
        windows[i] = StrandView { segments, pair: (pairs.len() - 1) as u8, is_backward: false };
    }
    assert!(pairs.len() <= MAX_CLUSTER_VERTICES, "too many strands in a cluster");
    (pairs, windows)
}

/// The step from the middle of a pair, and by how much it is more than that to the middle.
fn step_and_bend([after, before]: [&[Point]; 2], order: u8) -> (Point, Point) {
    let step = minus(after[1], after[0]);
    let bend = match (before.get(1), after.get(2)) {
        (Some(&last), _) => minus(step, minus(after[0], last)),
        // Without a point before the middle there is a choice: one with nothing left at the next point but one.
        (None, Some(&next)) if order == 3 => minus(minus(next, after[1]), step),
        _ => [0; FIELDS],
    };
    (step, bend)
}

/// What is left of each point of a side but the first two, with differences of order 1, 2 and 3.
fn rests(side: &[Point], bend: Point) -> impl Iterator<Item = [Point; 3]> {
    let first_step = side.get(1).map_or([0; FIELDS], |&next| minus(next, side[0]));
    let (mut last_step, mut last_bend) = (first_step, bend);
    side.windows(2).skip(1).map(move |points| {
        let step = minus(points[1], points[0]);
        let bend = minus(step, last_step);
        let rests = [step, bend, minus(bend, last_bend)];
        (last_step, last_bend) = (step, bend);
        rests
    })
}

fn minus(a: Point, b: Point) -> Point {
    let field = |i: usize| a[i].wrapping_sub(b[i]);
    [field(0), field(1), field(2), field(3)]
}

/// The codes of pairs with differences of order 1, 2 and 3.
fn strand_codes(points: &[Point], pairs: &[Pair]) -> [StrandCode; 3] {
    let mut step_widths = Magnitudes::default();
    let (mut bend_widths, mut rest_widths) = <([Magnitudes; 3], [Magnitudes; 3])>::default();
    let (mut least, mut greatest, mut reach) = (u8::MAX, 0, [0; 2]);
    for pair in pairs {
        let sides = pair.clone().map(|side| &points[side]);
        step_widths.add(minus(sides[0][1], sides[0][0]));
        for (widths, order) in bend_widths.iter_mut().zip(1..) {
            widths.add(step_and_bend(sides, order).1);
        }
        // The bend matters to order 3 alone.
        let (_, bend) = step_and_bend(sides, 3);
        for (side, reach) in sides.into_iter().zip(&mut reach) {
            for rests in rests(side, bend) {
                rest_widths.iter_mut().zip(rests).for_each(|(widths, rest)| widths.add(rest));
            }
            *reach = (*reach).max(side.len().saturating_sub(1) as u8);
        }
        let radius = sides[0][0][3] as u8;
        (least, greatest) = (least.min(radius), greatest.max(radius));
    }
    [1, 2, 3].map(|order: u8| StrandCode {
        step: step_widths.bits(),
        bend: bend_widths[usize::from(order) - 1].bits(),
        rest: rest_widths[usize::from(order) - 1].bits(),
        radius_anchor: least,
        radius_bits: (8 - (greatest - least).leading_zeros()) as u8,
        order,
        reach,
    })
}

/// How great fields are that are taken for signed.
#[derive(Default)]
struct Magnitudes([u32; FIELDS]);

impl Magnitudes {
    fn add(&mut self, point: Point) {
        for (all, field) in self.0.iter_mut().zip(point) {
            // Twice the number, or twice its complement and one: as many bits as two's complement takes.
            *all |= field << 1 ^ (field as i32 >> 31) as u32;
        }
    }

    fn bits(&self) -> Widths {
        self.0.map(|all| (32 - all.leading_zeros()) as u8)
    }
}

/// Fields one after the other, the first bits lowest.
struct BitWriter<'a> {
    bytes: &'a mut Vec<u8>,
    begin: usize,
    bits: usize,
}

impl BitWriter<'_> {
    fn push(&mut self, fields: Point, widths: &Widths) {
        for (field, &bits) in fields.into_iter().zip(widths) {
            let (byte, shift) = (self.begin + self.bits / 8, self.bits % 8);
            let word = (u64::from(field) & ((1 << bits) - 1)) << shift;
            self.bits += usize::from(bits);
            self.bytes.resize(self.begin + self.bits.div_ceil(8), 0);
            for (to, from) in self.bytes[byte..].iter_mut().zip(word.to_le_bytes()) {
                *to |= from;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::strand_code::PAIR_SLACK;
    use proptest::prelude::*;

    /// Strands of so many segments each, cut into windows; a strand of one window is no pair.
    fn windows(points: usize, lengths: &[usize]) -> Vec<Vec<u8>> {
        let (mut first, mut windows) = (0, Vec::new());
        for &length in lengths.iter().filter(|&&length| length > 0) {
            if first + length >= points {
                break;
            }
            windows.push((first..=first + length).map(|i| i as u8).collect());
            first += length;
        }
        windows
    }

    fn round_trip(vertices: &[Vec3], radii: &[u8], windows: &[Vec<u8>]) -> StrandPairs {
        let radii_of = |refs: &[u8]| refs.iter().map(|&r| radii[usize::from(r)]).collect::<Vec<_>>();
        let radii: Vec<Vec<u8>> = windows.iter().map(|refs| radii_of(refs)).collect();
        let parts: Vec<StrandParts> = windows
            .iter()
            .zip(&radii)
            .map(|(refs, radii)| StrandParts { refs, radii, geometry: 0 })
            .collect();
        let pairs = StrandPairs::of(vertices, &parts);
        pairs.code.check_axes().expect("a code that was made is sound");
        pairs.strand_code.check(&pairs.code).expect("a code that was made is sound");
        let mut bytes = pairs.bytes();
        bytes.extend([0xA5; PAIR_SLACK]);
        let bytes = &bytes[size_of::<StrandCode>()..];
        for (part, &window) in parts.iter().zip(&pairs.windows) {
            assert_eq!(StrandView::of(&window.record()), window);
            pairs.strand_code.check_window(&pairs.code, window).expect("a window that was made is sound");
            let points = pairs.strand_code.decode(&pairs.code, bytes, window);
            for k in 0..points.radii.len() {
                let given = k.min(part.refs.len() - 1);
                let vertex = vertices[usize::from(part.refs[given])].to_array().map(f32::to_bits);
                assert_eq!([0, 1, 2].map(|axis| points.axes[axis][k].to_bits()), vertex);
                assert_eq!(points.radii[k], part.radii[given]);
            }
        }
        pairs
    }

    proptest! {
        #[test]
        fn any_bits_come_through(bits in prop::collection::vec(prop::array::uniform3(any::<u32>()), 2..40),
            radii in prop::collection::vec(any::<u8>(), 40), lengths in prop::collection::vec(0..7usize, 1..9),
            is_shuffled in any::<bool>()) {
            let finite = |b: u32| Some(f32::from_bits(b)).filter(|x| x.is_finite()).unwrap_or(-0.0);
            let vertices: Vec<Vec3> = bits.iter().map(|b| Vec3::from_array(b.map(finite))).collect();
            let mut windows = windows(vertices.len(), &lengths);
            if is_shuffled {
                windows.reverse();
            }
            if !windows.is_empty() {
                round_trip(&vertices, &radii, &windows);
            }
        }

        #[test]
        fn curves_come_through(from in prop::array::uniform3(-1e3f32..1e3), bend in prop::array::uniform3(-1f32..1.0),
            scale in -40..10i32, lengths in prop::collection::vec(1..7usize, 1..9)) {
            let scale = (scale as f32).exp2();
            let at = |k: usize| Vec3::from_array(from) + Vec3::from_array(bend) * scale * (k * k) as f32;
            let vertices: Vec<Vec3> = (0..50).map(at).collect();
            let radii: Vec<u8> = (0..50).map(|k| 255 - 5 * k).collect();
            round_trip(&vertices, &radii, &windows(50, &lengths));
        }
    }

    #[test]
    fn even_curves_are_short() {
        let straight: Vec<Vec3> = (0..9).map(|k| Vec3::new(1000.0 + k as f32 * 0.25, 7.5, 0.0)).collect();
        let pairs = round_trip(&straight, &[9; 9], &windows(9, &[4, 4]));
        assert_eq!((pairs.code.stride, pairs.strand_code.reach), (1, [4, 4]));
        let bent: Vec<Vec3> = (0..9).map(|k| Vec3::new((k * k) as f32, 0.0, k as f32)).collect();
        let pairs = round_trip(&bent, &[1, 2, 3, 4, 5, 6, 7, 8, 9], &windows(9, &[4, 4]));
        assert_eq!((pairs.strand_code.order, pairs.strand_code.rest), (3, [0; FIELDS]));
    }
}
