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
use super::{InjectError, Target, buffer};
use rspirv::dr::Builder;
use rspirv::spirv::Word;

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

    /// `void begin()`: computes what all records of a fragment have in common.
    pub fn begin(&self, builder: &mut Builder) -> Result {
        let (mut w, function, _) = Writer::begin(builder, self.types, &[])?;
        let w = &mut w;
        let place = lanes::place(w, &self.inputs);
        let capacity = self.append.capacity(w)?;
        let known = self.inputs.known;
        w.store_variable(known.lane, place.lane)?;
        w.store_variable(known.packed, place.packed)?;
        w.store_variable(known.capacity, capacity)?;
        w.end()?;
        Ok(function)
    }

    /// `void quads(uint group, vec2 at[count])`: records a quad with this number of coordinates.
    pub fn quads(&self, builder: &mut Builder, count: u32) -> Result {
        let Types { u32, vec2, .. } = self.types;
        let mut parameters = vec![u32];
        parameters.extend((0..count).map(|_| vec2));
        let (mut w, function, parameters) = Writer::begin(builder, self.types, &parameters)?;
        let w = &mut w;
        let (&group, at) = parameters.split_first().ok_or(NO_PARAMETERS)?;
        // Derivatives need all lanes of the quad, so they come first.
        let slopes: Vec<Slopes> = at.iter().map(|at| Slopes::new(w, *at)).collect();
        let lanes = Lanes::new(w, &self.inputs);
        let packed = w.variable(self.inputs.known.packed);
        let header = header(w, group, lanes.quad, count << buffer::GROUPS_SHIFT);
        let known = self.inputs.known;
        let (first, fits) = (self.append).reserve(w, &lanes, known, 1 + 2 * count, Each::Quad)?;
        let is_first = lanes.is_first(w);
        let fits = w.guard(fits)?;
        let of_quad = w.guard(is_first)?;
        (self.append).header(w, &self.inputs, first, [header, packed])?;
        w.merge(&of_quad)?;
        self.lane(w, first, lanes.lane, at)?;
        // The first lane of the quad also stores the coordinates of inactive lanes.
        for step in 1..4 {
            let other = lanes.other(w, step);
            let absent = lanes.is_absent(w, other);
            let stores = w.both(absent, is_first);
            let stores = w.guard(stores)?;
            let there: Vec<Word> = (slopes.iter())
                .map(|slopes| slopes.coordinates(w, lanes.lane, step))
                .collect();
            self.lane(w, first, other, &there)?;
            w.merge(&stores)?;
        }
        w.merge(&fits)?;
        w.end()?;
        Ok(function)
    }

    /// Stores the coordinates of a lane of the quad.
    fn lane(&self, w: &mut Writer<'_>, first: Word, lane: Word, at: &[Word]) -> Result<()> {
        let first = w.unsigned(rspirv::spirv::Op::IAdd, &[first, lane]);
        for (number, at) in (0..).zip(at) {
            let words = [0, 1].map(|axis| {
                let part = w.extracted(*at, axis, self.types.f32);
                w.bits(part)
            });
            self.append.pair(w, first, 2 + 4 * number, words)?;
        }
        Ok(())
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
        let packed = w.variable(self.inputs.known.packed);
        let header = header(w, group, lanes.own, buffer::FRAGMENT);
        let (known, units) = (self.inputs.known, buffer::FRAGMENT_UNITS);
        let (first, fits) = (self.append).reserve(w, &lanes, known, units, Each::Lane)?;
        let fits = w.guard(fits)?;
        (self.append).header(w, &self.inputs, first, [header, packed])?;
        let mut words = vec![element];
        for vector in [at, dx, dy] {
            for axis in 0..3 {
                let part = w.extracted(vector, axis, f32);
                words.push(w.bits(part));
            }
        }
        words.push(w.bits(lod));
        words.push(w.constant(0));
        for (offset, words) in (2..).zip(words.chunks_exact(2)) {
            (self.append).pair(w, first, offset, [words[0], words[1]])?;
        }
        w.merge(&fits)?;
        w.end()?;
        Ok(function)
    }
}

const NO_PARAMETERS: InjectError = InjectError::Malformed("parameters");
