//! Finds the sites of a shader, their coordinate groups, and the places where groups are recorded together.

use super::InjectError;
use super::find::{Found, find};
use super::flow::unconditional;
use super::numbers::{Number, Numbers};
use super::reads::{ReadCounts, kind_of_texture};
use super::shader::Shader;
use rspirv::dr::{Function, Instruction};
use rspirv::spirv::Op;
use spool::DepthTests;
use spool::buffer::MOST_GROUPS;
use spool::{Form, Lod, Shape, Site, What};
use std::collections::{HashMap, HashSet};

/// Indices of function, block and instruction.
pub(super) type At = (usize, usize, usize);

/// Coordinate groups with consecutive numbers that the same lanes record together, before an instruction.
pub(super) struct Batch {
    /// Number of the first group.
    pub group: u16,
    /// One instruction per group.
    pub of: Vec<Found>,
    at: At,
}

/// The sites of a shader and their batches.
pub(super) struct Sites {
    pub sites: Vec<Site>,
    /// Index of the entry point's function.
    pub main: usize,
    /// Batches by the instruction that they precede.
    pub batches: HashMap<At, Batch>,
    /// Group for the start of each fragment, if no other site records it or if fragments may be discarded.
    pub entry: Option<u16>,
    /// Group for the end of each fragment.
    pub end: Option<u16>,
    /// Reads of a vertex shader that are not recorded.
    pub unrecorded: ReadCounts,
}

impl Sites {
    pub fn new(shader: &Shader, tests: DepthTests) -> Result<Self, InjectError> {
        let mut search = Search {
            shader,
            discards: shader.instructions().any(|i| discards(i.class.opcode)),
            sites: Vec::new(),
            batches: Vec::new(),
            unrecorded: ReadCounts::new(),
        };
        let mut main = 0;
        for &number in &shader.functions {
            let function = &shader.module.functions[number];
            let is_main = function.def.as_ref().and_then(|d| d.result_id) == Some(shader.main);
            if is_main {
                main = number;
            }
            search.function(number, function, is_main);
        }
        let Search {
            sites: open,
            batches,
            unrecorded,
            ..
        } = search;
        // Groups are numbered batch by batch, so the first number of a batch determines the others.
        let mut next = 0;
        let mut numbers = Vec::with_capacity(batches.len());
        for batch in &batches {
            numbers.push(next);
            next += batch.of.len();
        }
        let number =
            |number: usize| u16::try_from(number).map_err(|_| InjectError::TooManySites(number));
        let mut all = Self {
            sites: Vec::with_capacity(open.len() + 2),
            main,
            batches: HashMap::new(),
            entry: None,
            end: None,
            unrecorded,
        };
        for site in open {
            all.sites.push(Site {
                what: site.what,
                form: site.form,
                group: number(numbers[site.group.batch] + site.group.place)?,
                unconditional: site.unconditional,
            });
        }
        for (mut batch, first) in batches.into_iter().zip(numbers) {
            batch.group = number(first)?;
            all.batches.insert(batch.at, batch);
        }
        let covers = |site: &Site| site.unconditional && site.form == Form::Quad;
        let discards = tests == DepthTests::EarlyLateWrite;
        let is_covered = shader.is_vertex() || all.sites.iter().any(covers);
        if discards || !is_covered {
            all.entry = Some(all.push(What::Coverage, number(next)?, true));
            next += 1;
        }
        if discards {
            all.end = Some(all.push(What::Survival, number(next)?, false));
        }
        Ok(all)
    }

    fn push(&mut self, what: What, group: u16, unconditional: bool) -> u16 {
        self.sites.push(Site {
            what,
            form: Form::Quad,
            group,
            unconditional,
        });
        group
    }
}

/// Whether an instruction may end fragments or turn them into helper invocations.
fn discards(opcode: Op) -> bool {
    matches!(
        opcode,
        Op::Kill | Op::TerminateInvocation | Op::DemoteToHelperInvocation
    )
}

/// Place of a coordinate group. Its number is not known until all batches are complete.
#[derive(Clone, Copy)]
struct Group {
    batch: usize,
    place: usize,
}

struct OpenSite {
    what: What,
    form: Form,
    group: Group,
    unconditional: bool,
}

struct Search<'a> {
    shader: &'a Shader,
    discards: bool,
    sites: Vec<OpenSite>,
    batches: Vec<Batch>,
    unrecorded: ReadCounts,
}

/// Code that the same lanes execute: the coordinates recorded so far, and the batch that may still grow.
#[derive(Default)]
struct SameLanes {
    groups: HashMap<Number, Group>,
    batch: Option<usize>,
}

impl Search<'_> {
    fn function(&mut self, number: usize, function: &Function, is_main: bool) {
        let mut numbers = Numbers::default();
        let always = if is_main {
            unconditional(function)
        } else {
            HashSet::new()
        };
        let mut demoted = false;
        // The same lanes execute all of a block and, unless some are discarded, all blocks that every
        // fragment executes.
        let mut of_all = SameLanes::default();
        for (block, body) in function.blocks.iter().enumerate() {
            numbers.forget();
            let mut of_block = SameLanes::default();
            let is_always = always.contains(&block);
            let lanes = if is_always && !self.discards {
                &mut of_all
            } else {
                &mut of_block
            };
            for (place, instruction) in body.instructions.iter().enumerate() {
                let found = find(self.shader, instruction);
                if let Some(found) = found.and_then(|found| self.recorded(found)) {
                    let coordinate = numbers.of(found.coordinate);
                    let at = (number, block, place);
                    self.add(found, coordinate, is_always && !demoted, at, lanes);
                }
                let opcode = instruction.class.opcode;
                demoted |= opcode == Op::DemoteToHelperInvocation;
                if self.discards && (demoted || opcode == Op::FunctionCall) {
                    *lanes = SameLanes::default();
                }
                numbers.take(self.shader, instruction);
            }
        }
    }

    /// What is recorded of an image instruction. The reads of a vertex shader without an explicit level, and those of
    /// other textures than two-dimensional ones and their arrays, are counted instead.
    fn recorded(&mut self, found: Found) -> Option<Found> {
        if !self.shader.is_vertex() {
            return Some(found);
        }
        match &found.what {
            What::Texture(of) if of.shape != Shape::Cube && matches!(of.lod, Lod::Explicit(_)) => {
                Some(Found {
                    form: Form::Fragment,
                    ..found
                })
            }
            _ => {
                let what = kind_of_texture(found.what)?;
                *self.unrecorded.entry(what).or_default() += 1;
                None
            }
        }
    }

    fn add(
        &mut self,
        found: Found,
        coordinate: Number,
        unconditional: bool,
        at: At,
        lanes: &mut SameLanes,
    ) {
        let is_texture = matches!(found.what, What::Texture(_));
        let is_quad = is_texture && found.form == Form::Quad;
        // The record has only the coordinates, so that other instructions can share it.
        let is_plain = is_quad && found.divisor.is_none();
        let (what, form) = (found.what.clone(), found.form);
        let known = lanes.groups.get(&coordinate).copied().filter(|_| is_plain);
        let group = known.unwrap_or_else(|| {
            let group = self.group(found, at, is_quad, lanes);
            if is_plain {
                lanes.groups.insert(coordinate, group);
            }
            group
        });
        self.sites.push(OpenSite {
            what,
            form,
            group,
            unconditional,
        });
    }

    /// Adds a group to the batch of the same lanes, or to a new batch.
    fn group(&mut self, found: Found, at: At, joins: bool, lanes: &mut SameLanes) -> Group {
        let open = lanes.batch.filter(|_| joins);
        if let Some(number) = open
            && let Some(batch) = self.batches.get_mut(number)
            && batch.of.len() < MOST_GROUPS
        {
            batch.at = at;
            batch.of.push(found);
            return Group {
                batch: number,
                place: batch.of.len() - 1,
            };
        }
        let batch = self.batches.len();
        self.batches.push(Batch {
            group: 0,
            of: vec![found],
            at,
        });
        if joins {
            lanes.batch = Some(batch);
        }
        Group { batch, place: 0 }
    }
}

/// Whether an instruction must stay at the start of its block.
pub(super) fn stays_first(instruction: &Instruction) -> bool {
    matches!(
        instruction.class.opcode,
        Op::Variable | Op::Line | Op::NoLine | Op::Phi
    )
}
