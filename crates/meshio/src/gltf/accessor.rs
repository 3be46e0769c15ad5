//! Accessors: typed views of buffers, checked once so that reading an element cannot fail.

use super::buffer::Buffers;
use super::document::{Document, entry};
use super::{syntax, unsupported};
use crate::Result;
use crate::emit::Vertices;
use crate::resident::Resident;
use gltf::json::Accessor as JsonAccessor;
use gltf::json::accessor::{ComponentType, GenericComponentType, IndexComponentType, Type, sparse::Sparse};
use gltf::json::validation::Checked;
use std::path::Path;

/// Elements of an accessor that has no bytes: more than any file needs, little enough to read quickly.
const MAX_ZEROS: u64 = 1 << 24;
/// Some megabytes when they are read one after the other.
const ELEMENTS_BETWEEN_RELEASES: u64 = 1 << 20;

/// An accessor whose elements all lie inside its buffer.
pub(super) struct Accessor<'a> {
    buffers: &'a Buffers<'a>,
    elements: Elements<'a>,
    resident: Resident,
    normalized: bool,
    /// Components of an element.
    width: usize,
    sparse: Option<Replaced<'a>>,
}

/// A number of elements at equal distances.
#[derive(Clone, Copy)]
struct Elements<'a> {
    /// From the first element on; empty where all elements are zero.
    bytes: &'a [u8],
    stride: usize,
    count: u64,
    component: ComponentType,
}

/// Elements that have other values than the accessor's view says.
struct Replaced<'a> {
    /// In ascending order.
    indices: Elements<'a>,
    values: Elements<'a>,
}

impl<'a> Accessor<'a> {
    /// Checks the accessor that the place `at` names; it must hold elements of type `kind`.
    pub fn new(
        path: &Path,
        document: &Document,
        buffers: &'a Buffers<'a>,
        index: usize,
        kind: Type,
        at: &str,
    ) -> Result<Accessor<'a>> {
        let (accessor, component) = json(path, document, index, kind, at)?;
        let at = format!("accessors[{index}]");
        let count = accessor.count.0;
        let checked = Check { path, buffers, width: kind.multiplicity() };
        let elements = match &accessor.buffer_view {
            Some(view) => {
                let offset = accessor.byte_offset.map_or(0, |offset| offset.0);
                checked.elements(view.value(), offset, count, component, &at)?
            }
            None if count > MAX_ZEROS => {
                let what = format!("has {count} elements but no bufferView; export the file again");
                return Err(syntax(path, at, what));
            }
            None => Elements { bytes: &[], stride: 0, count, component },
        };
        let sparse =
            accessor.sparse.as_ref().map(|sparse| checked.replaced(sparse, elements, &at)).transpose()?;
        let resident = Resident::new(elements.bytes, buffers.max_resident);
        let (normalized, width) = (accessor.normalized, kind.multiplicity());
        Ok(Accessor { buffers, elements, resident, normalized, width, sparse })
    }

    /// An accessor of elements of `width` components that lie behind each other.
    pub fn of_bytes(
        buffers: &'a Buffers<'a>,
        bytes: &'a [u8],
        width: usize,
        component: ComponentType,
        normalized: bool,
    ) -> Accessor<'a> {
        let stride = width * component.size();
        let count = (bytes.len() / stride.max(1)) as u64;
        let elements = Elements { bytes, stride, count, component };
        let resident = Resident::new(bytes, buffers.max_resident);
        Accessor { buffers, elements, resident, normalized, width, sparse: None }
    }

    /// The elements that an accessor lists, which `at` names. Does not decompress them.
    pub fn count_of(
        path: &Path,
        document: &Document,
        buffers: &'a Buffers<'a>,
        index: usize,
        kind: Type,
        at: &str,
    ) -> Result<u64> {
        let (accessor, component) = json(path, document, index, kind, at)?;
        let (at, count) = (format!("accessors[{index}]"), accessor.count.0);
        if let Some(view) = &accessor.buffer_view
            && let Some(length) = buffers.compressed_length(view.value(), &format!("{at}.bufferView"))?
        {
            let stride = document.buffer_views[view.value()].byte_stride.map(|stride| stride.0);
            let checked = Check { path, buffers, width: kind.multiplicity() };
            let offset = accessor.byte_offset.map_or(0, |offset| offset.0);
            checked.stride(
                view.value(),
                length,
                stride.filter(|&s| s != 0),
                offset,
                count,
                component,
                &at,
            )?;
            return Ok(count);
        }
        Ok(Accessor::new(path, document, buffers, index, kind, &at)?.count())
    }

    pub fn count(&self) -> u64 {
        self.elements.count
    }

    pub fn component(&self) -> ComponentType {
        self.elements.component
    }

    /// Components of an element.
    pub fn width(&self) -> usize {
        self.width
    }

    pub fn is_normalized(&self) -> bool {
        self.normalized
    }

    /// Whether its length is a mere claim: all elements are zero, or nearly all.
    pub fn is_without_bytes(&self) -> bool {
        self.elements.bytes.is_empty() && self.elements.count > 0
    }

    /// The components of element `i`, at most four; zero where it has fewer.
    pub fn element(&self, i: u64) -> [f64; 4] {
        match self.width {
            2 => {
                let [x, y] = self.components(i);
                [x, y, 0.0, 0.0]
            }
            3 => {
                let [x, y, z] = self.components(i);
                [x, y, z, 0.0]
            }
            _ => self.components(i),
        }
    }

    /// An element of an accessor of type SCALAR with unsigned components.
    #[inline]
    pub fn index(&self, i: u64) -> u32 {
        let (elements, i) = self.locate(i);
        elements.index(i)
    }

    /// Where the value of element `i` is.
    #[inline]
    fn locate(&self, i: u64) -> (&Elements<'a>, u64) {
        match &self.sparse {
            Some(sparse) => match sparse.find(i) {
                Some(replaced) => (&sparse.values, replaced),
                None => (&self.elements, i),
            },
            None => (&self.elements, i),
        }
    }
}

impl Vertices for Accessor<'_> {
    fn count(&self) -> u64 {
        self.elements.count
    }

    #[inline]
    fn position(&self, index: u32) -> [f64; 3] {
        self.components(u64::from(index))
    }

    fn release(&self) {
        self.buffers.release();
        self.resident.clear();
    }
}

impl Accessor<'_> {
    /// The first `N` components of element `i`, which must have as many.
    #[inline]
    pub fn components<const N: usize>(&self, i: u64) -> [f64; N] {
        let (elements, i) = self.locate(i);
        if elements.bytes.is_empty() {
            return [0.0; N];
        }
        let offset = i as usize * elements.stride;
        // Values of sparse accessors count as if they were elsewhere: they are few.
        if !self.resident.touch(offset) {
            self.release();
        }
        let element = &elements.bytes[offset..];
        match elements.component {
            ComponentType::F32 => read::<4, N>(element, |b| f64::from(f32::from_le_bytes(b))),
            ComponentType::U32 => read::<4, N>(element, |b| f64::from(u32::from_le_bytes(b))),
            ComponentType::U16 => {
                read::<2, N>(element, |b| self.scaled(u16::from_le_bytes(b).into(), u16::MAX.into()))
            }
            ComponentType::I16 => {
                read::<2, N>(element, |b| self.scaled(i16::from_le_bytes(b).into(), i16::MAX.into()))
            }
            ComponentType::U8 => read::<1, N>(element, |[b]| self.scaled(b.into(), u8::MAX.into())),
            ComponentType::I8 => read::<1, N>(element, |[b]| self.scaled((b as i8).into(), i8::MAX.into())),
        }
    }

    /// Normalized integers stand for -1 to 1; the least integer is one less than -1 needs.
    #[inline]
    fn scaled(&self, value: f64, max: f64) -> f64 {
        if self.normalized { (value / max).max(-1.0) } else { value }
    }
}

#[inline]
fn read<const BYTES: usize, const N: usize>(element: &[u8], decode: impl Fn([u8; BYTES]) -> f64) -> [f64; N] {
    std::array::from_fn(|component| decode(std::array::from_fn(|byte| element[component * BYTES + byte])))
}

/// What the document says of an accessor that the place `at` names, and the type of its components.
fn json<'a>(
    path: &Path,
    document: &'a Document,
    index: usize,
    kind: Type,
    at: &str,
) -> Result<(&'a JsonAccessor, ComponentType)> {
    let accessor = entry(&document.accessors, index, path, at)?;
    let at = format!("accessors[{index}]");
    let Checked::Valid(GenericComponentType(component)) = accessor.component_type else {
        return Err(unsupported(
            path,
            format_args!("{at}.componentType"),
            "is none of glTF 2.0; export again",
        ));
    };
    if !matches!(accessor.type_, Checked::Valid(found) if found == kind) {
        return Err(syntax(
            path,
            format_args!("{at}.type"),
            format_args!("must be {kind:?} here; export again"),
        ));
    }
    Ok((accessor, component))
}

impl Elements<'_> {
    #[inline]
    fn index(&self, i: u64) -> u32 {
        if self.bytes.is_empty() {
            return 0;
        }
        let element = &self.bytes[i as usize * self.stride..];
        match self.component.size() {
            1 => element[0].into(),
            2 => u16::from_le_bytes([element[0], element[1]]).into(),
            _ => u32::from_le_bytes([element[0], element[1], element[2], element[3]]),
        }
    }
}

impl Replaced<'_> {
    fn find(&self, i: u64) -> Option<u64> {
        let (mut low, mut high) = (0, self.indices.count);
        while low < high {
            let middle = low + (high - low) / 2;
            match u64::from(self.indices.index(middle)).cmp(&i) {
                std::cmp::Ordering::Equal => return Some(middle),
                std::cmp::Ordering::Less => low = middle + 1,
                std::cmp::Ordering::Greater => high = middle,
            }
        }
        None
    }
}

/// What all parts of an accessor have in common.
struct Check<'a, 'p> {
    path: &'p Path,
    buffers: &'a Buffers<'a>,
    /// Components of an element.
    width: usize,
}

impl<'a> Check<'a, '_> {
    fn elements(
        &self,
        view: usize,
        offset: u64,
        count: u64,
        component: ComponentType,
        at: &str,
    ) -> Result<Elements<'a>> {
        let (bytes, stride) = self.buffers.view(view, &format!("{at}.bufferView"))?;
        let stride = self.stride(view, bytes.len() as u64, stride, offset, count, component, at)?;
        Ok(Elements { bytes: &bytes[(offset as usize).min(bytes.len())..], stride, count, component })
    }

    /// The distance of elements, if all of them fit into a view of `length` bytes.
    #[expect(clippy::too_many_arguments, reason = "all that views and accessors say")]
    fn stride(
        &self,
        view: usize,
        length: u64,
        stride: Option<usize>,
        offset: u64,
        count: u64,
        component: ComponentType,
        at: &str,
    ) -> Result<usize> {
        let size = self.width * component.size();
        let stride = stride.unwrap_or(size);
        if stride < size {
            let what = format!("has elements of {size} bytes every {stride} bytes; export the file again");
            return Err(syntax(self.path, at, what));
        }
        // The last element needs no bytes behind it up to the stride.
        let needed = match count {
            0 => Some(0),
            _ => (count - 1).checked_mul(stride as u64).and_then(|bytes| bytes.checked_add(size as u64)),
        };
        let end = needed.and_then(|needed| needed.checked_add(offset));
        if end.is_none_or(|end| end > length) {
            let what = format!(
                "has {count} elements from byte {offset} on, more than the {length} bytes of bufferViews[{view}] \
                 hold; export the file again"
            );
            return Err(syntax(self.path, at, what));
        }
        Ok(stride)
    }

    fn replaced(&self, sparse: &Sparse, base: Elements, at: &str) -> Result<Replaced<'a>> {
        let at = format!("{at}.sparse");
        let Checked::Valid(IndexComponentType(component)) = sparse.indices.component_type else {
            return Err(syntax(self.path, format_args!("{at}.indices.componentType"), "is not unsigned"));
        };
        let (count, indices, values) = (sparse.count.0, &sparse.indices, &sparse.values);
        let scalars = Check { width: 1, ..*self };
        let indices =
            scalars.elements(indices.buffer_view.value(), indices.byte_offset.0, count, component, &at)?;
        let values =
            self.elements(values.buffer_view.value(), values.byte_offset.0, count, base.component, &at)?;
        let ascending = (1..count).all(|i| {
            if i % ELEMENTS_BETWEEN_RELEASES == 0 {
                self.buffers.release();
            }
            indices.index(i - 1) < indices.index(i)
        });
        if !ascending || (count > 0 && u64::from(indices.index(count - 1)) >= base.count) {
            let what = "must be in ascending order and below the accessor's count; export the file again";
            return Err(syntax(self.path, format_args!("{at}.indices"), what));
        }
        Ok(Replaced { indices, values })
    }
}
