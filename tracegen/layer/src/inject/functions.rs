//! The functions that append records.
//!
//! A subgroup reserves space for all its records with one atomic operation. Then each lane stores its own
//! coordinates. Derivatives also need the coordinates of lanes that are not active; the first active lane of
//! the quad stores them. On a CPU, the stores are the main cost of recording.
//!
//! The functions have no loops. Lavapipe counts the iterations of all loops of a shader in one variable, and
//! each further loop doubles the time in which LLVM analyses that variable.

use super::append::{Append, Each, header};
use super::declare::{Inputs, Types};
use super::lanes::{self, Lanes, Slopes};
use super::writer::{Result, Writer};
use super::{InjectError, Target};
use crate::record_buffer::NO_CAPACITY;
use rspirv::dr::Builder;
use rspirv::spirv::{Op, Word};
use spool::buffer::{self, GROUPS_SHIFT};

/// Declares the functions of a module.
pub(super) struct Functions {
    types: Types,
    inputs: Inputs,
    append: Append,
}

impl Functions {
    pub fn new(
        builder: &mut Builder,
        types: Types,
        inputs: Inputs,
        target: &Target,
        vulkan_memory: bool,
    ) -> Self {
        Self {
            append: Append::new(builder, types, target, vulkan_memory),
            types,
            inputs,
        }
    }

    /// `void begin()`: computes what all records of a fragment or a vertex have in common.
    pub fn begin(&self, builder: &mut Builder) -> Result {
        let (mut w, function, _) = Writer::begin(builder, self.types, &[])?;
        let w = &mut w;
        let place = match self.inputs.is_vertex {
            true => lanes::vertex_place(w, &self.inputs),
            false => lanes::place(w, &self.inputs),
        };
        let capacity = self.append.capacity(w)?;
        let known = self.inputs.known;
        w.store_variable(known.lane, place.lane)?;
        w.store_variable(known.packed, place.packed)?;
        w.store_variable(known.capacity, capacity)?;
        if !self.inputs.is_vertex {
            self.never_discard(w, capacity)?;
        }
        w.end()?;
        Ok(function)
    }

    /// A discard that never happens. Lavapipe compiles a second version of a shader for tiles that an opaque
    /// triangle covers, unless the shader discards; it then also drops the earlier draws of such tiles, whose records
    /// would be lost.
    fn never_discard(&self, w: &mut Writer<'_>, capacity: Word) -> Result<()> {
        let no_capacity = w.constant(NO_CAPACITY);
        let never = w.pure(Op::IEqual, w.types.bool, &[capacity, no_capacity]);
        let guard = w.guard(never)?;
        w.kill(&guard)
    }

    /// `void quads(uint group, vec2 at[count])`: records a quad with this number of coordinates.
    pub fn quads(&self, builder: &mut Builder, count: u32) -> Result {
        let Types { u32, f32, vec2, .. } = self.types;
        let mut parameters = vec![u32];
        parameters.extend((0..count).map(|_| vec2));
        let (mut w, function, parameters) = Writer::begin(builder, self.types, &parameters)?;
        let w = &mut w;
        let (&group, at) = parameters.split_first().ok_or(NO_PARAMETERS)?;
        // Derivatives need all lanes of the quad, so they come first.
        let slopes: Vec<Slopes> = at.iter().map(|at| Slopes::new(w, *at, vec2)).collect();
        let lanes = Lanes::new(w, &self.inputs);
        let header = header(w, &self.inputs, group, lanes.quad, count << GROUPS_SHIFT);
        let (record, fits) = self.reserve(w, &lanes, 1 + 2 * count, Each::Quad)?;
        let is_first = lanes.is_first(w);
        let fits = w.guard(fits)?;
        let stores = w.guard(is_first)?;
        self.append.pair(w, record, 0, [header[0], header[1]])?;
        self.append.pair(w, record, 1, [header[2], header[3]])?;
        w.merge(&stores)?;
        self.each_lane(w, &lanes, is_first, record, |w, to, step| {
            for (number, slopes) in (0..).zip(&slopes) {
                let at = slopes.coordinates(w, lanes.lane, step);
                let words = [0, 1].map(|axis| {
                    let part = w.extracted(at, axis, f32);
                    w.bits(part)
                });
                self.append.pair(w, to, 2 + 4 * number, words)?;
            }
            Ok(())
        })?;
        w.merge(&fits)?;
        w.end()?;
        Ok(function)
    }

    /// `void depth(uint group, float depth)`: records a quad with its depth.
    pub fn depth(&self, builder: &mut Builder) -> Result {
        let Types { u32, f32, .. } = self.types;
        let (mut w, function, parameters) = Writer::begin(builder, self.types, &[u32, f32])?;
        let w = &mut w;
        let [group, depth] = parameters[..] else {
            return Err(NO_PARAMETERS);
        };
        let slopes = Slopes::new(w, depth, f32);
        let lanes = Lanes::new(w, &self.inputs);
        let header = header(w, &self.inputs, group, lanes.quad, buffer::DEPTH);
        let (record, fits) = self.reserve(w, &lanes, buffer::DEPTH_UNITS, Each::Quad)?;
        let is_first = lanes.is_first(w);
        let fits = w.guard(fits)?;
        self.each_lane(w, &lanes, is_first, record, |w, to, step| {
            let lane = lanes.other(w, step);
            let word = w.select_word(lane, header);
            let depth = slopes.coordinates(w, lanes.lane, step);
            let depth = w.bits(depth);
            self.append.pair(w, to, 0, [word, depth])
        })?;
        w.merge(&fits)?;
        w.end()?;
        Ok(function)
    }

    /// Lets each active lane store its part of a record, which is a pair of words behind that of the lane before.
    /// The first active lane also stores the parts of the inactive ones. `store` gets the address, and the step
    /// from the own lane to the lane whose part it is.
    fn each_lane(
        &self,
        w: &mut Writer<'_>,
        lanes: &Lanes,
        is_first: Word,
        record: Word,
        mut store: impl FnMut(&mut Writer<'_>, Word, u32) -> Result<()>,
    ) -> Result<()> {
        let own = self.append.after_pairs(w, record, lanes.lane);
        store(w, own, 0)?;
        for step in 1..4 {
            let other = lanes.other(w, step);
            let absent = lanes.is_absent(w, other);
            let stores = w.both(absent, is_first);
            let stores = w.guard(stores)?;
            let to = self.append.after_pairs(w, record, other);
            store(w, to, step)?;
            w.merge(&stores)?;
        }
        Ok(())
    }

    fn reserve(
        &self,
        w: &mut Writer<'_>,
        lanes: &Lanes,
        units: u32,
        each: Each,
    ) -> Result<(Word, Word)> {
        (self.append).reserve(w, lanes, self.inputs.known, units, each)
    }

    /// `void fragment(uint group, uint element, vec3 at, float lod, vec3 dx, vec3 dy)`
    pub fn fragment(&self, builder: &mut Builder) -> Result {
        let Types { u32, f32, vec3, .. } = self.types;
        let parameters = [u32, u32, vec3, f32, vec3, vec3];
        let (mut w, function, parameters) = Writer::begin(builder, self.types, &parameters)?;
        let w = &mut w;
        let [group, element, at, lod, dx, dy] = parameters[..] else {
            return Err(NO_PARAMETERS);
        };
        let lanes = Lanes::new(w, &self.inputs);
        let kind = match self.inputs.is_vertex {
            true => buffer::FRAGMENT | buffer::VERTEX,
            false => buffer::FRAGMENT,
        };
        let mut words = header(w, &self.inputs, group, lanes.own, kind).to_vec();
        let (record, fits) = self.reserve(w, &lanes, buffer::FRAGMENT_UNITS, Each::Lane)?;
        let fits = w.guard(fits)?;
        words.push(element);
        for vector in [at, dx, dy] {
            for axis in 0..3 {
                let part = w.extracted(vector, axis, f32);
                words.push(w.bits(part));
            }
        }
        words.extend([w.bits(lod), w.constant(0)]);
        for (offset, words) in (0..).zip(words.chunks_exact(2)) {
            (self.append).pair(w, record, offset, [words[0], words[1]])?;
        }
        w.merge(&fits)?;
        w.end()?;
        Ok(function)
    }
}

const NO_PARAMETERS: InjectError = InjectError::Malformed("parameters");
