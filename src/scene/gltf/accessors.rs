//! Lists of a glTF file: any component type, normalised or not, with sparse changes.

use std::collections::HashMap;

use glam::DVec3;
use gltf::Accessor;
use gltf::accessor::sparse::IndexType;
use gltf::accessor::{DataType, Dimensions};

use super::super::limits::TRIANGLES;
use super::buffers::Buffers;

/// Largest number of elements of a list: no more are used.
const ELEMENTS: usize = 3 * TRIANGLES;

/// The same for lists without a view, which take no bytes of the file.
const WITHOUT_VIEW: usize = 1 << 16;

const BEYOND: &str = "is damaged: a list reaches beyond its view";

impl Buffers {
    /// The vectors of an accessor, two or three numbers each; the third is zero where there is
    /// none. Fails with a reason that follows the file's name.
    pub(super) fn vectors(&self, accessor: &Accessor) -> Result<Vec<DVec3>, String> {
        let components = match accessor.dimensions() {
            Dimensions::Vec2 => 2,
            Dimensions::Vec3 | Dimensions::Vec4 => 3,
            _ => return Err("has numbers where vectors belong".to_owned()),
        };
        let (kind, count) = (accessor.data_type(), checked_count(accessor)?);
        let component = |bytes: &[u8], index: usize| {
            let size = kind.size();
            number(&bytes[index * size..(index + 1) * size], kind, accessor.normalized())
        };
        let vector = |bytes: &[u8]| {
            DVec3::from_array(std::array::from_fn(|axis| {
                if axis < components { component(bytes, axis) } else { 0.0 }
            }))
        };
        let mut vectors = match accessor.view() {
            Some(view) => {
                let stride = view.stride().unwrap_or(accessor.size());
                let bytes = self.view(&view)?;
                let bytes = bytes.get(accessor.offset()..).ok_or(BEYOND)?;
                elements(bytes, stride, accessor.size(), count)?.map(vector).collect()
            }
            None => vec![DVec3::ZERO; count],
        };
        if let Some(sparse) = accessor.sparse() {
            let values = self.view(&sparse.values().view())?;
            let values = values.get(sparse.values().offset()..).ok_or(BEYOND)?;
            let values = elements(values, accessor.size(), accessor.size(), sparse.count())?;
            let places = self.view(&sparse.indices().view())?;
            let places = places.get(sparse.indices().offset()..).ok_or(BEYOND)?;
            let kind = match sparse.indices().index_type() {
                IndexType::U8 => DataType::U8,
                IndexType::U16 => DataType::U16,
                IndexType::U32 => DataType::U32,
            };
            let places = elements(places, kind.size(), kind.size(), sparse.count())?;
            for (place, value) in places.zip(values) {
                let place = number(place, kind, false) as usize;
                *vectors.get_mut(place).ok_or("is damaged: a sparse index is too large")? = vector(value);
            }
        }
        Ok(vectors)
    }

    /// The indices of an accessor into a list of `length` elements. Fails with a reason that
    /// follows the file's name.
    pub(super) fn indices(&self, accessor: &Accessor, length: usize) -> Result<Vec<u32>, String> {
        let (kind, count) = (accessor.data_type(), checked_count(accessor)?);
        let is_index = matches!(kind, DataType::U8 | DataType::U16 | DataType::U32);
        if accessor.dimensions() != Dimensions::Scalar || !is_index || accessor.sparse().is_some() {
            return Err("has a list of indices of another kind than unsigned integers".to_owned());
        }
        let indices: Vec<u32> = match accessor.view() {
            Some(view) => {
                let stride = view.stride().unwrap_or(accessor.size());
                let bytes = self.view(&view)?.get(accessor.offset()..).ok_or(BEYOND)?;
                let indices = elements(bytes, stride, accessor.size(), count)?;
                indices.map(|bytes| number(bytes, kind, false) as u32).collect()
            }
            None => vec![0; count],
        };
        match indices.iter().find(|&&index| index as usize >= length) {
            Some(index) => Err(format!("is damaged: vertex {index} is named, there are {length}")),
            None => Ok(indices),
        }
    }
}

fn checked_count(accessor: &Accessor) -> Result<usize, String> {
    let most = if accessor.view().is_some() { ELEMENTS } else { WITHOUT_VIEW };
    match accessor.count() {
        count if count > most => Err(format!("has a list of {count} elements, {most} at most can be read")),
        count => Ok(count),
    }
}

/// `count` elements of `size` bytes, `stride` bytes apart.
fn elements(
    bytes: &[u8],
    stride: usize,
    size: usize,
    count: usize,
) -> Result<impl Iterator<Item = &[u8]>, String> {
    let end = count.checked_sub(1).map_or(Some(0), |last| last.checked_mul(stride)?.checked_add(size));
    if stride < size || end.is_none_or(|end| end > bytes.len()) {
        return Err(BEYOND.to_owned());
    }
    Ok((0..count).map(move |index| &bytes[index * stride..index * stride + size]))
}

/// One component, little endian. Normalised integers stand for 0..=1, or -1..=1 if signed.
fn number(bytes: &[u8], kind: DataType, is_normalised: bool) -> f64 {
    let (value, most) = match kind {
        DataType::I8 => (f64::from(bytes[0] as i8), f64::from(i8::MAX)),
        DataType::U8 => (f64::from(bytes[0]), f64::from(u8::MAX)),
        DataType::I16 => (f64::from(i16::from_le_bytes([bytes[0], bytes[1]])), f64::from(i16::MAX)),
        DataType::U16 => (f64::from(u16::from_le_bytes([bytes[0], bytes[1]])), f64::from(u16::MAX)),
        DataType::U32 => {
            (f64::from(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])), f64::from(u32::MAX))
        }
        DataType::F32 => {
            return f64::from(f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]));
        }
    };
    if is_normalised { (value / most).max(-1.0) } else { value }
}

/// The vertices out of `count` that a mesh uses, and its indices into them: primitives may share
/// one long list.
pub(super) fn used(mut indices: Vec<u32>, count: usize) -> (Vec<u32>, Vec<u32>) {
    if indices.len() >= count {
        return ((0..count as u32).collect(), indices);
    }
    let (mut used, mut places) = (Vec::new(), HashMap::new());
    for index in &mut indices {
        *index = *places.entry(*index).or_insert_with(|| {
            used.push(*index);
            used.len() as u32 - 1
        });
    }
    (used, indices)
}
