//! The bytes of the hierarchy's content. FORMAT.md has the layout.
#![deny(clippy::indexing_slicing, clippy::cast_possible_truncation)]

use super::BvhSummary;
use super::hierarchy::{ChildKind, Hierarchy, HierarchyChild, HierarchyTriangle};
use crate::parse::{Cursor, Parsed, Taken};
use crate::varint::{low_u32, put, put_difference, unzigzag, zigzag};

/// Kinds of a child, in the lowest bits of its first number.
const NONE: u64 = 0;
const NODE: u64 = 1;
const LEAF: u64 = 2;
/// Bits of a child's first number: the zigzag of a difference of 32-bit numbers, and the kind.
const CHILD_BITS: u32 = 35;
/// Bits of a triangle's first number: the zigzag of a difference of primitives, and whether it is masked.
const TRIANGLE_BITS: u32 = 34;
/// Smallest size of a triangle: its number, and a reference for each vertex.
const LEAST_TRIANGLE_BYTES: usize = 4;
/// Number of vertices back to which a reference can point: those of 16 triangles.
const MOST_BACK: u32 = 48;

type Corners = [[f32; 3]; 2];

impl Hierarchy {
    /// Size of the encoded nodes and triangles together. Encodes them, so that the time can be measured.
    pub fn encoded_bytes(&self, bvh: &BvhSummary) -> usize {
        encode_nodes(bvh, self).len() + encode_triangles(&self.triangles).len()
    }
}

/// Writes the inner nodes.
pub(super) fn encode_nodes(bvh: &BvhSummary, hierarchy: &Hierarchy) -> Vec<u8> {
    let width = bvh.traversal.width();
    let nodes = hierarchy.children.len() / width;
    let mut boxes: Vec<Corners> = vec![[[0.0; 3]; 2]; nodes];
    let mut out = Vec::with_capacity(16 * hierarchy.children.len());
    let mut next_slot = 0;
    for (number, children) in (0u32..).zip(hierarchy.children.chunks_exact(width)) {
        let own = boxes.get(number as usize).copied().unwrap_or_default();
        for child in children {
            let Some(child) = child else {
                put(NONE, &mut out);
                continue;
            };
            match child.kind {
                ChildKind::Node(index) => {
                    let behind = i64::from(index) - i64::from(number);
                    put(zigzag(behind) << 2 | NODE, &mut out);
                    if let Some(entry) = boxes.get_mut(index as usize) {
                        *entry = [child.min, child.max];
                    }
                }
                ChildKind::Leaf(first, count) => {
                    let behind = i64::from(first) - next_slot;
                    put(zigzag(behind) << 2 | LEAF, &mut out);
                    put(u64::from(count.saturating_sub(1)), &mut out);
                    next_slot = i64::from(first) + i64::from(count);
                }
            }
            put_box(own, [child.min, child.max], &mut out);
        }
    }
    out
}

/// Writes a box: a bit for each plane that is not its parent's, then their differences.
fn put_box(own: Corners, child: Corners, out: &mut Vec<u8>) {
    let planes = || own.as_flattened().iter().zip(child.as_flattened());
    let bits = (0u8..).zip(planes());
    out.push(bits.fold(0, |bits, (at, (own, plane))| {
        bits | u8::from(own.to_bits() != plane.to_bits()) << at
    }));
    for (own, plane) in planes() {
        if own.to_bits() != plane.to_bits() {
            put_difference(&mut own.to_bits(), plane.to_bits(), out);
        }
    }
}

/// Reads the inner nodes.
pub(super) fn decode_nodes<'a>(
    bvh: &BvhSummary,
    input: &'a [u8],
) -> Parsed<'a, Vec<Option<HierarchyChild>>> {
    let mut input = Cursor::new(input);
    let width = bvh.traversal.width();
    let most = input.rest().len() / width;
    let nodes = usize::try_from(bvh.nodes).unwrap_or(usize::MAX);
    if nodes > most {
        let expected = format!("at most {most} nodes, for which there are bytes");
        return Err(input.fault(expected, nodes));
    }
    let mut boxes: Vec<Corners> = vec![[[0.0; 3]; 2]; nodes];
    let mut children = Vec::with_capacity(nodes * width);
    let mut next_slot = 0;
    for number in 0..nodes {
        let own = boxes.get(number).copied().unwrap_or_default();
        for _ in 0..width {
            let Some(kind) = take_child(&mut input, number, &mut next_slot)? else {
                children.push(None);
                continue;
            };
            let [min, max] = take_box(own, &mut input)?;
            if let ChildKind::Node(index) = kind
                && let Some(entry) = boxes.get_mut(index as usize)
            {
                *entry = [min, max];
            }
            children.push(Some(HierarchyChild { kind, min, max }));
        }
    }
    Ok((input.rest(), children))
}

fn take_child<'a>(
    input: &mut Cursor<'a>,
    number: usize,
    next_slot: &mut i64,
) -> Taken<'a, Option<ChildKind>> {
    let at = *input;
    let code = input.number("a child", CHILD_BITS)?;
    let difference = unzigzag(code >> 2);
    let from = |start: i64| {
        let index = start.saturating_add(difference);
        u32::try_from(index).map_err(|_| at.fault("a node or slot below 2^32", index))
    };
    Ok(match code & 3 {
        NONE if code == NONE => None,
        NODE => Some(ChildKind::Node(from(
            i64::try_from(number).unwrap_or(i64::MAX),
        )?)),
        LEAF => {
            let first = from(*next_slot)?;
            let count = input
                .number_u32("the triangles of a leaf")?
                .saturating_add(1);
            *next_slot = i64::from(first) + i64::from(count);
            Some(ChildKind::Leaf(first, count))
        }
        _ => return Err(at.fault("a child of kind 0 to 2, or 0", code)),
    })
}

fn take_box<'a>(own: Corners, input: &mut Cursor<'a>) -> Taken<'a, Corners> {
    let at = *input;
    let bits: u8 = input.fixed("a box")?;
    if bits >> 6 != 0 {
        return Err(at.fault("bits of six planes", format_args!("{bits:#04x}")));
    }
    let mut corners = own;
    for (at, plane) in (0u8..).zip(corners.as_flattened_mut()) {
        if bits >> at & 1 == 1 {
            let mut value = plane.to_bits();
            input.difference(&mut value, "a plane of a box")?;
            *plane = f32::from_bits(value);
        }
    }
    Ok(corners)
}

/// Writes the triangles.
pub(super) fn encode_triangles(triangles: &[HierarchyTriangle]) -> Vec<u8> {
    let mut out = Vec::with_capacity(16 * triangles.len());
    let mut primitive = 0;
    let mut vertices = Recent::default();
    for triangle in triangles {
        let difference = i64::from(triangle.primitive) - i64::from(primitive);
        primitive = triangle.primitive;
        put(
            zigzag(difference) << 1 | u64::from(triangle.masked),
            &mut out,
        );
        for vertex in triangle.vertices {
            vertices.put(vertex.map(f32::to_bits), &mut out);
        }
    }
    out
}

/// Reads the triangles.
pub(super) fn decode_triangles<'a>(
    bvh: &BvhSummary,
    input: &'a [u8],
) -> Parsed<'a, Vec<HierarchyTriangle>> {
    let mut input = Cursor::new(input);
    let most = input.rest().len() / LEAST_TRIANGLE_BYTES;
    let count = usize::try_from(bvh.triangles).unwrap_or(usize::MAX);
    if count > most {
        let expected = format!("at most {most} triangles, for which there are bytes");
        return Err(input.fault(expected, count));
    }
    let mut triangles: Vec<HierarchyTriangle> = Vec::with_capacity(count);
    let mut vertices = Recent::default();
    let mut primitive = 0u32;
    for _ in 0..count {
        let at = input;
        let code = input.number("a primitive", TRIANGLE_BITS)?;
        let number = i64::from(primitive).saturating_add(unzigzag(code >> 1));
        primitive =
            u32::try_from(number).map_err(|_| at.fault("a primitive number below 2^32", number))?;
        let mut triangle = HierarchyTriangle {
            primitive,
            masked: code & 1 == 1,
            ..HierarchyTriangle::default()
        };
        for vertex in &mut triangle.vertices {
            *vertex = vertices.take(&mut input)?.map(f32::from_bits);
        }
        triangles.push(triangle);
    }
    Ok((input.rest(), triangles))
}

/// The last vertices that were read.
#[derive(Debug)]
struct Recent {
    vertices: [[u32; 3]; MOST_BACK as usize],
    count: u64,
}

impl Default for Recent {
    fn default() -> Self {
        Self {
            vertices: [[0; 3]; MOST_BACK as usize],
            count: 0,
        }
    }
}

impl Recent {
    /// The vertex that was read some vertices ago; zero before the first.
    fn back(&self, back: u64) -> [u32; 3] {
        let at = self.count.wrapping_sub(back) % u64::from(MOST_BACK);
        let found = self.vertices.get(low_u32(at) as usize);
        found.copied().unwrap_or_default()
    }

    fn take<'a>(&mut self, input: &mut Cursor<'a>) -> Taken<'a, [u32; 3]> {
        let at = *input;
        let back = input.number_u32("a vertex")?;
        if back > MOST_BACK || u64::from(back) > self.count {
            let most = self.count.min(MOST_BACK.into());
            return Err(at.fault(format!("a vertex at most {most} back"), back));
        }
        let mut vertex = self.back(u64::from(back.max(1)));
        if back == 0 {
            for value in &mut vertex {
                input.difference(value, "a coordinate")?;
            }
        }
        self.push(vertex);
        Ok(vertex)
    }

    fn put(&mut self, vertex: [u32; 3], out: &mut Vec<u8>) {
        let most = self.count.min(MOST_BACK.into());
        let found = (1..=most).find(|back| self.back(*back) == vertex);
        put(found.unwrap_or(0), out);
        if found.is_none() {
            for (mut last, value) in self.back(1).into_iter().zip(vertex) {
                put_difference(&mut last, value, out);
            }
        }
        self.push(vertex);
    }

    fn push(&mut self, vertex: [u32; 3]) {
        let place = low_u32(self.count % u64::from(MOST_BACK)) as usize;
        if let Some(entry) = self.vertices.get_mut(place) {
            *entry = vertex;
        }
        self.count += 1;
    }
}
