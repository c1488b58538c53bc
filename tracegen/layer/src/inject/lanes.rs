//! Lanes of a quad: where a fragment is, which lanes are active, and coordinates of other lanes.

use super::declare::{Input, Inputs, Types};
use super::writer::Writer;
use rspirv::spirv::{Op, Word};
use spool::buffer::MOST_INSTANCES;

/// Position of a fragment.
pub(super) struct FragmentPlace {
    /// Lane of the quad.
    pub lane: Word,
    /// Column and row of the quad, and the view, packed into a word.
    pub packed: Word,
}

/// Computes the position of the fragment.
pub(super) fn place(w: &mut Writer<'_>, inputs: &Inputs) -> FragmentPlace {
    let Types { f32, vec4, .. } = w.types;
    let Input { variable, .. } = inputs.place;
    let at = w.pure(Op::Load, vec4, &[variable]);
    let [one, thirteen] = [1, 13].map(|v| w.constant(v));
    let pixel = [0, 1].map(|axis| {
        let part = w.extracted(at, axis, f32);
        w.unsigned(Op::ConvertFToU, &[part])
    });
    let odd = pixel.map(|p| w.unsigned(Op::BitwiseAnd, &[p, one]));
    let quad = pixel.map(|p| w.unsigned(Op::ShiftRightLogical, &[p, one]));
    let below = w.unsigned(Op::ShiftLeftLogical, &[odd[1], one]);
    let lane = w.unsigned(Op::BitwiseOr, &[odd[0], below]);
    let row = w.unsigned(Op::ShiftLeftLogical, &[quad[1], thirteen]);
    let packed = w.unsigned(Op::BitwiseOr, &[quad[0], row]);
    let packed = with_view(w, inputs, packed);
    FragmentPlace { lane, packed }
}

/// The position of a vertex: lane 0, and its instance and view.
pub(super) fn vertex_place(w: &mut Writer<'_>, inputs: &Inputs) -> FragmentPlace {
    let lane = w.constant(0);
    let most = w.constant(MOST_INSTANCES - 1);
    let instance = w.loaded(inputs.place);
    let instance = w.unsigned(Op::BitwiseAnd, &[instance, most]);
    let packed = with_view(w, inputs, instance);
    FragmentPlace { lane, packed }
}

/// A place with the number of the view above it.
fn with_view(w: &mut Writer<'_>, inputs: &Inputs, place: Word) -> Word {
    let Some(view) = inputs.view else {
        return place;
    };
    let shift = w.constant(MOST_INSTANCES.trailing_zeros());
    let view = w.loaded(view);
    let view = w.unsigned(Op::ShiftLeftLogical, &[view, shift]);
    w.unsigned(Op::BitwiseOr, &[place, view])
}

/// The active lanes at a site, and the lane of this fragment.
pub(super) struct Lanes {
    /// Lane of the quad.
    pub lane: Word,
    /// Mask with only the bit of this lane.
    pub own: Word,
    /// Active lanes of the quad.
    pub quad: Word,
    /// Active lanes of the subgroup, if ballots are used.
    pub subgroup: Option<Subgroup>,
}

pub(super) struct Subgroup {
    pub votes: Word,
    /// Mask with the bit of this invocation.
    pub own: Word,
    pub below_quad: Word,
    pub below_lane: Word,
}

impl Lanes {
    /// The active lanes. Without ballots, only the lane itself.
    pub fn new(w: &mut Writer<'_>, inputs: &Inputs) -> Self {
        let Types {
            uvec4, bool, u32, ..
        } = w.types;
        let one = w.constant(1);
        let Some(invocation) = inputs.invocation else {
            let lane = w.variable(inputs.known.lane);
            let own = w.unsigned(Op::ShiftLeftLogical, &[one, lane]);
            return Self {
                lane,
                own,
                quad: own,
                subgroup: None,
            };
        };
        let invocation = w.loaded(invocation);
        // The driver knows the invocations, so it computes at compile time what follows from the lane alone.
        let three = w.constant(3);
        let lane = w.unsigned(Op::BitwiseAnd, &[invocation, three]);
        let own = w.unsigned(Op::ShiftLeftLogical, &[one, lane]);
        // Helper lanes do not take part in ballots.
        let present = w.builder.constant_true(bool);
        let votes = w.of_subgroup(Op::GroupNonUniformBallot, uvec4, &[present]);
        let votes = w.extracted(votes, 0, u32);
        let [of_quad, all] = [28, 15].map(|v| w.constant(v));
        let first = w.unsigned(Op::BitwiseAnd, &[invocation, of_quad]);
        let quad = w.unsigned(Op::ShiftRightLogical, &[votes, first]);
        let quad = w.unsigned(Op::BitwiseAnd, &[quad, all]);
        let [quad_bit, lane_bit] =
            [first, invocation].map(|lane| w.unsigned(Op::ShiftLeftLogical, &[one, lane]));
        let [below_quad, below_lane] =
            [quad_bit, lane_bit].map(|bit| w.unsigned(Op::ISub, &[bit, one]));
        Self {
            lane,
            own,
            quad,
            subgroup: Some(Subgroup {
                votes,
                own: lane_bit,
                below_quad,
                below_lane,
            }),
        }
    }

    /// The lane `lane ^ step`.
    pub fn other(&self, w: &mut Writer<'_>, step: u32) -> Word {
        let step = w.constant(step);
        w.unsigned(Op::BitwiseXor, &[self.lane, step])
    }

    /// Whether this is the first active lane of its quad.
    pub fn is_first(&self, w: &mut Writer<'_>) -> Word {
        is_lowest(w, self.quad, self.own)
    }

    /// Whether a lane is not active.
    pub fn is_absent(&self, w: &mut Writer<'_>, lane: Word) -> Word {
        let [zero, one] = [0, 1].map(|v| w.constant(v));
        let active = w.unsigned(Op::ShiftRightLogical, &[self.quad, lane]);
        let active = w.unsigned(Op::BitwiseAnd, &[active, one]);
        w.pure(Op::IEqual, w.types.bool, &[active, zero])
    }
}

impl Subgroup {
    /// Whether this is the first active lane of the subgroup.
    pub fn is_first(&self, w: &mut Writer<'_>) -> Word {
        is_lowest(w, self.votes, self.own)
    }

    /// Mask with the first bit of each quad that has active lanes.
    pub fn quads(&self, w: &mut Writer<'_>) -> Word {
        let mut any = self.votes;
        for by in [1, 2] {
            let by = w.constant(by);
            let shifted = w.unsigned(Op::ShiftRightLogical, &[any, by]);
            any = w.unsigned(Op::BitwiseOr, &[any, shifted]);
        }
        let firsts = w.constant(0x1111_1111);
        w.unsigned(Op::BitwiseAnd, &[any, firsts])
    }
}

/// Whether a bit is the lowest one in a mask.
fn is_lowest(w: &mut Writer<'_>, mask: Word, bit: Word) -> Word {
    let zero = w.constant(0);
    let negative = w.unsigned(Op::ISub, &[zero, mask]);
    let lowest = w.unsigned(Op::BitwiseAnd, &[mask, negative]);
    w.pure(Op::IEqual, w.types.bool, &[lowest, bit])
}

/// A float or vector, and its change to the right, downwards, and of the first along the second.
pub(super) struct Slopes {
    of: Word,
    at: Word,
    by: [Word; 3],
}

impl Slopes {
    /// Derivatives of a value of a type. All lanes of the quad have to execute this.
    pub fn new(w: &mut Writer<'_>, at: Word, of: Word) -> Self {
        let [right, down] = [Op::DPdxFine, Op::DPdyFine].map(|opcode| w.pure(opcode, of, &[at]));
        let both = w.pure(Op::DPdxFine, of, &[down]);
        let by = [right, down, both];
        Self { of, at, by }
    }

    /// The value in the lane `lane ^ step`; `lane` is this fragment's.
    pub fn coordinates(&self, w: &mut Writer<'_>, lane: Word, step: u32) -> Word {
        let Types { f32, .. } = w.types;
        let one = w.constant(1);
        // 1 if the other lane is to the right or below, or -1.
        let [right, down] = [0, 1].map(|axis| {
            let axis = w.constant(axis);
            let bit = w.unsigned(Op::ShiftRightLogical, &[lane, axis]);
            let bit = w.unsigned(Op::BitwiseAnd, &[bit, one]);
            let bit = w.pure(Op::ConvertUToF, f32, &[bit]);
            let [one, two] = [1.0_f32, 2.0].map(|v| w.float(v));
            let twice = w.pure(Op::FMul, f32, &[bit, two]);
            w.pure(Op::FSub, f32, &[one, twice])
        });
        let both = w.pure(Op::FMul, f32, &[right, down]);
        let used = match step {
            0 => &[][..],
            1 => &[0],
            2 => &[1],
            _ => &[0, 1, 2],
        };
        let signs = [right, down, both];
        let times = if self.of == f32 {
            Op::FMul
        } else {
            Op::VectorTimesScalar
        };
        used.iter().fold(self.at, |found, &part| {
            let change = w.pure(times, self.of, &[self.by[part], signs[part]]);
            w.pure(Op::FAdd, self.of, &[found, change])
        })
    }
}
