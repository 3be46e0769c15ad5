//! Makes the [code](crate::strand_code) of a cluster of strands.

use crate::layout::MAX_CLUSTER_VERTICES;
use crate::strand_code::{FIELDS, Point, StrandCode, Widths};
use crate::strand_record::StrandView;
use crate::vertices::VertexCode;
use glam::Vec3;
use raystrips_geom::strand::WINDOW_SEGMENTS;

/// A window of a strand to be stored: vertices of the cluster that follow each other, and codes of the radii there.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StrandParts<'a> {
    pub refs: &'a [u8],
    pub radii: &'a [u8],
}

/// A cluster of strands as it is stored.
pub(crate) struct StrandPairs {
    pub code: VertexCode,
    pub strand_code: StrandCode,
    /// Each window, in the order in which they were given.
    pub windows: Vec<StrandView>,
    pairs: Vec<Pair>,
}

/// Bytes of the vertices and radii of a cluster of these windows.
pub fn strand_bytes<'a>(vertices: &[Vec3], windows: impl Iterator<Item = (&'a [u8], &'a [u8])>) -> usize {
    let windows: Vec<StrandParts> = windows.map(|(refs, radii)| StrandParts { refs, radii }).collect();
    StrandPairs::of(vertices, &windows).byte_count()
}

impl StrandPairs {
    /// The shortest code of these windows.
    ///
    /// # Panics
    /// If there is no window, or one has no or too many segments.
    pub fn of(vertices: &[Vec3], parts: &[StrandParts]) -> StrandPairs {
        let (sides, windows) = pair_up(parts);
        let all = VertexCode::of(vertices);
        let middles = sides.iter().map(|[after, _]| vertices[usize::from(after[0].0)]);
        let code = all.narrowed(middles);
        let points = |side: &Side| {
            let point = |&(vertex, radius): &(u8, u8)| {
                let [x, y, z] = code.numbers(vertices[usize::from(vertex)]);
                [x, y, z, u32::from(radius)]
            };
            side.iter().map(point).collect()
        };
        let sides: Vec<[Vec<Point>; 2]> = sides.iter().map(|pair| [0, 1].map(|i| points(&pair[i]))).collect();
        let code = VertexCode { last: (sides.len() - 1) as u8, ..code };
        let coded = [1, 2, 3].map(|order| Coded::of(&sides, order, code));
        let shortest = coded.into_iter().min_by_key(|coded| coded.code.stride);
        let Coded { code, strand_code, pairs } = shortest.expect("one of three");
        StrandPairs { code, strand_code, windows, pairs }
    }

    /// Bytes of what [`StrandPairs::write`] appends.
    pub fn byte_count(&self) -> usize {
        size_of::<StrandCode>() + self.pairs.len() * usize::from(self.code.stride)
    }

    /// Appends the code and the pairs.
    pub fn write(&self, out: &mut Vec<u8>) {
        out.extend_from_slice(bytemuck::bytes_of(&self.strand_code));
        for pair in &self.pairs {
            let mut bits = BitWriter::default();
            let widths = self.strand_code.middle(&self.code);
            bits.push(&pair.middle, &widths);
            bits.push(&pair.step, &self.strand_code.step);
            bits.push(&pair.bend, &self.strand_code.bend);
            for (rests, reach) in pair.rests.iter().zip(self.strand_code.reach) {
                for k in 0..usize::from(reach).saturating_sub(1) {
                    bits.push(rests.get(k).unwrap_or(&[0; FIELDS]), &self.strand_code.rest);
                }
            }
            bits.bytes.resize(self.code.stride.into(), 0);
            out.append(&mut bits.bytes);
        }
    }
}

/// The points of a window from the middle of its pair on: vertices and codes of radii.
type Side = Vec<(u8, u8)>;

/// Joins windows that follow each other. Gives for each pair what is after and what is before its middle, and where each
/// window is.
fn pair_up(parts: &[StrandParts]) -> (Vec<[Side; 2]>, Vec<StrandView>) {
    let mut order: Vec<usize> = (0..parts.len()).collect();
    order.sort_by_key(|&i| parts[i].refs[0]);
    let mut pairs: Vec<[Side; 2]> = Vec::new();
    let mut windows = vec![StrandView { segments: 0, pair: 0, is_backward: false }; parts.len()];
    let mut open: Option<usize> = None;
    for i in order {
        let StrandParts { refs, radii } = parts[i];
        let segments = refs.len() - 1;
        assert!((1..=WINDOW_SEGMENTS).contains(&segments), "{segments} segments in a window");
        assert_eq!(refs.len(), radii.len());
        let side: Side = refs.iter().copied().zip(radii.iter().copied()).collect();
        let before = open.take().filter(|&before| parts[before].refs.last() == refs.first());
        if let Some(before) = before {
            let pair = pairs.len() - 1;
            let mut back = std::mem::take(&mut pairs[pair][0]);
            back.reverse();
            pairs[pair] = [side, back];
            windows[before].is_backward = true;
        } else {
            pairs.push([side, Vec::new()]);
            open = Some(i);
        }
        windows[i] = StrandView { segments, pair: (pairs.len() - 1) as u8, is_backward: false };
    }
    assert!(pairs.len() <= MAX_CLUSTER_VERTICES, "too many strands in a cluster");
    (pairs, windows)
}

/// A pair as whole numbers.
struct Pair {
    middle: Point,
    step: Point,
    bend: Point,
    rests: [Vec<Point>; 2],
}

impl Pair {
    fn of([after, before]: &[Vec<Point>; 2], order: u8, radius_anchor: u8) -> Pair {
        let step = minus(after[1], after[0]);
        let bend = match (before.get(1), after.get(2)) {
            (Some(&last), _) => minus(step, minus(after[0], last)),
            // Without a point before the middle there is a choice: one with nothing left at the next point but one.
            (None, Some(&next)) if order == 3 => minus(minus(next, after[1]), step),
            _ => [0; FIELDS],
        };
        let mut middle = after[0];
        middle[3] -= u32::from(radius_anchor);
        Pair { middle, step, bend, rests: [after, before].map(|side| rests(side, order, bend)) }
    }
}

/// What is left of each point of a side but the first two.
fn rests(side: &[Point], order: u8, bend: Point) -> Vec<Point> {
    let step = |k: usize| minus(side[k], side[k - 1]);
    let bend = |k: usize| if k < 2 { bend } else { minus(step(k), step(k - 1)) };
    let rest = |k: usize| match order {
        1 => step(k),
        2 => bend(k),
        _ => minus(bend(k), bend(k - 1)),
    };
    (2..side.len()).map(rest).collect()
}

fn minus(a: Point, b: Point) -> Point {
    std::array::from_fn(|i| a[i].wrapping_sub(b[i]))
}

/// Pairs with differences of one order.
struct Coded {
    code: VertexCode,
    strand_code: StrandCode,
    pairs: Vec<Pair>,
}

impl Coded {
    fn of(sides: &[[Vec<Point>; 2]], order: u8, code: VertexCode) -> Coded {
        let radii = || sides.iter().map(|[after, _]| after[0][3] as u8);
        let (least, greatest) = radii().fold((u8::MAX, 0), |(a, b), r| (a.min(r), b.max(r)));
        let pairs: Vec<Pair> = sides.iter().map(|sides| Pair::of(sides, order, least)).collect();
        let reach = [0, 1].map(|i| {
            let segments = sides.iter().map(|sides| sides[i].len().saturating_sub(1));
            segments.max().unwrap_or(0) as u8
        });
        let strand_code = StrandCode {
            step: signed_widths(pairs.iter().map(|pair| &pair.step)),
            bend: signed_widths(pairs.iter().map(|pair| &pair.bend)),
            rest: signed_widths(pairs.iter().flat_map(|pair| pair.rests.iter().flatten())),
            radius_anchor: least,
            radius_bits: (8 - (greatest - least).leading_zeros()) as u8,
            order,
            reach,
        };
        let stride = strand_code.pair_bytes(&code) as u8;
        Coded { code: VertexCode { stride, ..code }, strand_code, pairs }
    }
}

/// Bits in two's complement of each field.
fn signed_widths<'a>(points: impl Iterator<Item = &'a Point>) -> Widths {
    let mut widths = [0; FIELDS];
    for point in points {
        for (width, &field) in widths.iter_mut().zip(point) {
            let field = field as i32;
            let magnitude = if field < 0 { !field } else { field };
            let bits = if field == 0 { 0 } else { 33 - magnitude.leading_zeros() };
            *width = (*width).max(bits as u8);
        }
    }
    widths
}

/// Fields one after the other, the first bits lowest.
#[derive(Default)]
struct BitWriter {
    bytes: Vec<u8>,
    bits: usize,
}

impl BitWriter {
    fn push(&mut self, fields: &Point, widths: &Widths) {
        for (&field, &bits) in fields.iter().zip(widths) {
            let (byte, shift) = (self.bits / 8, self.bits % 8);
            let word = (u64::from(field) & ((1 << bits) - 1)) << shift;
            self.bits += usize::from(bits);
            self.bytes.resize(self.bits.div_ceil(8), 0);
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
        let parts: Vec<StrandParts> =
            windows.iter().zip(&radii).map(|(refs, radii)| StrandParts { refs, radii }).collect();
        let pairs = StrandPairs::of(vertices, &parts);
        pairs.code.check_axes().expect("a code that was made is sound");
        pairs.strand_code.check(&pairs.code).expect("a code that was made is sound");
        let mut bytes = Vec::new();
        pairs.write(&mut bytes);
        assert_eq!(bytes.len(), pairs.byte_count());
        bytes.extend([0xA5; PAIR_SLACK]);
        let bytes = &bytes[size_of::<StrandCode>()..];
        for (part, &window) in parts.iter().zip(&pairs.windows) {
            assert_eq!(StrandView::of(&window.record()), Some(window));
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
