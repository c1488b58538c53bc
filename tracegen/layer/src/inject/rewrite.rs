//! Inserts the calls that record, and the declarations that they need.

use super::find::{Found, find};
use super::flow::unconditional;
use super::numbers::{Number, Numbers};
use super::recorder::Recorder;
use super::shader::Shader;
use super::site::{Form, Lod, Site, What};
use super::{DepthTests, InjectError, Target};
use rspirv::binary::Assemble;
use rspirv::dr::{Instruction, Operand};
use rspirv::spirv::{ExecutionMode, Op, Word};
use std::collections::{HashMap, HashSet};

/// The recording module, and its sites.
pub(super) fn rewrite(
    shader: Shader,
    tests: DepthTests,
    target: &Target,
) -> Result<(Vec<u32>, Vec<Site>), InjectError> {
    let mut sites = Sites::new(&shader, tests)?;
    let (functions, main) = (shader.functions.clone(), shader.main);
    let mut recorder = Recorder::new(&shader, target)?;
    if tests == DepthTests::Either || tests == DepthTests::EarlyLateWrite {
        // The shader that discards is used by a draw of its own, which writes nothing.
        recorder
            .builder
            .execution_mode(main, ExecutionMode::EarlyFragmentTests, []);
    }
    for function in functions {
        let is_main = sites.main == function;
        let blocks = recorder.builder.module_ref().functions[function]
            .blocks
            .len();
        for block in 0..blocks {
            let body = &mut recorder.builder.module_mut().functions[function].blocks[block];
            let old = std::mem::take(&mut body.instructions);
            let mut new = Vec::with_capacity(2 * old.len());
            let mut entry_site = sites.entry_site.filter(|_| is_main && block == 0);
            for (place, instruction) in old.into_iter().enumerate() {
                if !matches!(
                    instruction.class.opcode,
                    Op::Variable | Op::Line | Op::NoLine | Op::Phi
                ) && let Some(site) = entry_site.take()
                {
                    recorder.record_depth(site, &mut new);
                }
                if let Some((site, found)) = sites.by_place.remove(&(function, block, place)) {
                    record(&mut recorder, &shader, site, &found, &mut new);
                }
                if instruction.class.opcode == Op::Return
                    && is_main
                    && let Some(site) = sites.end_site
                {
                    recorder.record_depth(site, &mut new);
                }
                new.push(instruction);
            }
            recorder.builder.module_mut().functions[function].blocks[block].instructions = new;
        }
    }
    Ok((recorder.finish().assemble(), sites.sites))
}

/// The sites of a shader, and where they are.
struct Sites {
    sites: Vec<Site>,
    /// Position of the entry point's function.
    main: usize,
    /// By function, block and instruction: the sites that have records of their own.
    by_place: HashMap<(usize, usize, usize), (u16, Found)>,
    /// Records every fragment that starts, where no other site does, or where depths are needed.
    entry_site: Option<u16>,
    /// Records every fragment that ends.
    end_site: Option<u16>,
}

impl Sites {
    fn new(shader: &Shader, tests: DepthTests) -> Result<Self, InjectError> {
        let mut all = Self {
            sites: Vec::new(),
            main: 0,
            by_place: HashMap::new(),
            entry_site: None,
            end_site: None,
        };
        for &number in &shader.functions {
            let function = &shader.module.functions[number];
            let is_main = function.def.as_ref().and_then(|d| d.result_id) == Some(shader.main);
            if is_main {
                all.main = number;
            }
            let mut numbers = Numbers::default();
            let always = if is_main {
                unconditional(function)
            } else {
                HashSet::new()
            };
            let mut demoted = false;
            // Lanes are the same within a block, and in all blocks that every fragment executes.
            let (mut of_all, mut of_block) = (HashMap::new(), HashMap::new());
            for (block, body) in function.blocks.iter().enumerate() {
                numbers.forget();
                of_block.clear();
                let unconditional = always.contains(&block) && !demoted;
                let leaders: &mut HashMap<Number, u16> = if always.contains(&block) {
                    &mut of_all
                } else {
                    &mut of_block
                };
                for (place, instruction) in body.instructions.iter().enumerate() {
                    if let Some(found) = find(shader, instruction) {
                        let leads = numbers.of(found.coordinate);
                        let site =
                            all.add(found, unconditional, (number, block, place), |plain| {
                                plain.then(|| leaders.get(&leads).copied()).flatten()
                            })?;
                        if let Some(site) = site {
                            leaders.entry(leads).or_insert(site);
                        }
                    }
                    demoted |= instruction.class.opcode == Op::DemoteToHelperInvocation;
                    numbers.take(shader, instruction);
                }
            }
        }
        let is_covered = all
            .sites
            .iter()
            .any(|site| site.unconditional && site.leader.is_none() && site.form == Form::Quad);
        let discards = tests == DepthTests::EarlyLateWrite;
        if discards || !is_covered {
            all.entry_site = Some(all.push(What::Coverage, true)?);
        }
        if discards {
            all.end_site = Some(all.push(What::Survival, false)?);
        }
        Ok(all)
    }

    /// Adds an instruction. Tells its site where others with the same coordinates may share its records.
    fn add(
        &mut self,
        found: Found,
        unconditional: bool,
        place: (usize, usize, usize),
        leader: impl FnOnce(bool) -> Option<u16>,
    ) -> Result<Option<u16>, InjectError> {
        let number = self.next()?;
        // All that is recorded of it is its coordinates.
        let plain = found.form == Form::Quad && found.divisor.is_none();
        let plain = plain && matches!(found.what, What::Texture(_));
        let leader = leader(plain);
        self.sites.push(Site {
            what: found.what.clone(),
            form: found.form,
            leader,
            unconditional,
        });
        if leader.is_none() {
            self.by_place.insert(place, (number, found));
        }
        Ok((plain && leader.is_none()).then_some(number))
    }

    fn push(&mut self, what: What, unconditional: bool) -> Result<u16, InjectError> {
        let number = self.next()?;
        self.sites.push(Site {
            what,
            form: Form::Quad,
            leader: None,
            unconditional,
        });
        Ok(number)
    }

    fn next(&self) -> Result<u16, InjectError> {
        let sites = self.sites.len();
        u16::try_from(sites).map_err(|_| InjectError::TooManySites(sites))
    }
}

/// Records an instruction before it is executed.
fn record(
    recorder: &mut Recorder,
    shader: &Shader,
    site: u16,
    found: &Found,
    out: &mut Vec<Instruction>,
) {
    if matches!(found.what, What::LeftOut(_)) {
        recorder.record_presence(site, out);
        return;
    }
    let mut at = recorder.floats(shader, found.coordinate, out);
    if let Some(divisor) = found.divisor
        && let Some(&q) = at.get(divisor as usize)
    {
        at.truncate(divisor as usize);
        for part in &mut at {
            *part = recorder.divided(*part, q, out);
        }
    }
    if found.form == Form::Quad {
        recorder.record_quad(site, &at, out);
        return;
    }
    let lod = found.lod.map(|lod| recorder.float(shader, lod, out));
    let gradients = match (&found.what, found.gradients) {
        (_, Some(named)) => Some(named.map(|id| recorder.floats(shader, id, out))),
        (What::Texture(of), None) if matches!(of.lod, Lod::Derivatives | Lod::Bias(_)) => {
            Some(recorder.derivatives(&at, out))
        }
        _ => None,
    };
    let element = found.element.map(|id| recorder.unsigned(shader, id, out));
    recorder.record_fragment(site, element, &at, lod, gradients, out);
}

/// Appends an instruction with a result, and tells its id.
pub(super) fn put(
    builder: &mut rspirv::dr::Builder,
    out: &mut Vec<Instruction>,
    opcode: Op,
    result_type: Word,
    operands: Vec<Operand>,
) -> Word {
    let id = builder.id();
    out.push(Instruction::new(
        opcode,
        Some(result_type),
        Some(id),
        operands,
    ));
    id
}
