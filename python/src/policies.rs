//! Replacement policies implemented as Python classes. A call into Python costs far more than a
//! look-up.

use crate::errors::{Failure, ParallaxError};
use crate::jobs::Stop;
use anyhow::Result;
use pyo3::prelude::*;
use replay::memory::{Policy, Replacement};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// The first exception of a class. After it, the class's methods are not called any more.
#[derive(Clone, Default)]
struct Slot(Arc<Mutex<Calls>>);

/// Whether a class may be called.
#[derive(Default)]
struct Calls {
    failed: bool,
    error: Option<PyErr>,
    stop: Stop,
}

impl Slot {
    fn calls(&self) -> MutexGuard<'_, Calls> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn may_call(&self) -> bool {
        let calls = self.calls();
        !calls.failed && !calls.stop.is_asked()
    }

    fn fail(&self, error: PyErr) {
        let mut calls = self.calls();
        calls.failed = true;
        calls.error.get_or_insert(error);
    }
}

/// The slots of all registered classes.
static SLOTS: Mutex<Vec<(String, Slot)>> = Mutex::new(Vec::new());

/// Held by a replay with policies in Python, because exceptions are stored per class.
static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());

/// Registers a class as a policy under this name, which configurations then accept.
#[pyfunction]
pub fn name_policy(name: String, class: Py<PyAny>) {
    let slot = Slot::default();
    let mut slots = SLOTS.lock().unwrap_or_else(PoisonError::into_inner);
    slots.retain(|(other, _)| *other != name);
    slots.push((name.clone(), slot.clone()));
    let title = name.clone();
    let make = move |sets, ways| -> Box<dyn Policy> {
        let methods = Python::attach(|py| Methods::of(class.bind(py), sets, ways));
        Box::new(InPython {
            methods: methods.map_err(|error| slot.fail(error)).ok(),
            ways,
            slot: slot.clone(),
            name: title.clone(),
        })
    };
    let _ = Replacement::own(&name, Box::new(make));
}

/// Runs `job`, and raises the first exception of these classes instead of its result.
pub fn watched<T: Send>(
    names: &[String],
    stop: &Stop,
    job: impl FnOnce() -> Result<T> + Send,
) -> Result<T, Failure> {
    if names.is_empty() {
        return Ok(job()?);
    }
    let _alone = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
    let slots: Vec<Slot> = {
        let slots = SLOTS.lock().unwrap_or_else(PoisonError::into_inner);
        let named = slots.iter().filter(|(name, _)| names.contains(name));
        named.map(|(_, slot)| slot.clone()).collect()
    };
    for slot in &slots {
        *slot.calls() = Calls {
            stop: stop.clone(),
            ..Calls::default()
        };
    }
    if stop.is_asked() {
        return Err(anyhow::anyhow!("interrupted").into());
    }
    // Attaching a thread for each call takes longer than the call. Therefore one thread stays
    // attached; other threads of the interpreter run whenever a method runs.
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let outcome = alone.install(|| Python::attach(|_| job()));
    let raised: Vec<PyErr> = slots
        .iter()
        .filter_map(|slot| slot.calls().error.take())
        .collect();
    match raised.into_iter().next() {
        Some(error) => Err(Failure::Raised(error)),
        None => Ok(outcome?),
    }
}

/// A cache's policy object.
struct InPython {
    /// None if the class cannot be instantiated.
    methods: Option<Methods>,
    ways: u32,
    slot: Slot,
    name: String,
}

/// The bound methods `hit`, `fill` and `victim`.
struct Methods {
    hit: Py<PyAny>,
    fill: Py<PyAny>,
    victim: Py<PyAny>,
}

impl Methods {
    /// The methods of a new object of the class.
    fn of(class: &Bound<'_, PyAny>, sets: u32, ways: u32) -> PyResult<Self> {
        let object = class.call1((sets, ways))?;
        let method = |name: &str| object.getattr(name).map(Bound::unbind);
        Ok(Self {
            hit: method("hit")?,
            fill: method("fill")?,
            victim: method("victim")?,
        })
    }
}

impl InPython {
    /// Calls a method unless one has failed.
    fn call<T>(&self, of: impl FnOnce(Python<'_>, &Methods) -> PyResult<T>) -> Option<T> {
        let methods = self.methods.as_ref()?;
        if !self.slot.may_call() {
            return None;
        }
        match Python::attach(|py| of(py, methods)) {
            Ok(value) => Some(value),
            Err(error) => {
                self.slot.fail(error);
                None
            }
        }
    }
}

impl Policy for InPython {
    fn hit(&mut self, set: u32, way: u32, line: u32) {
        self.call(|py, of| of.hit.call1(py, (set, way, line)).map(|_| ()));
    }

    fn fill(&mut self, set: u32, way: u32, line: u32) {
        self.call(|py, of| of.fill.call1(py, (set, way, line)).map(|_| ()));
    }

    fn victim(&mut self, set: u32) -> u32 {
        let (ways, name) = (self.ways, self.name.clone());
        let way = self.call(|py, of| {
            let found = of.victim.call1(py, (set,))?;
            let way: Option<u32> = found.extract(py).ok().filter(|&way| way < ways);
            way.ok_or_else(|| {
                let found = found
                    .bind(py)
                    .repr()
                    .map_or_else(|_| String::new(), |r| r.to_string());
                let last = ways - 1;
                ParallaxError::new_err(format!(
                    "{name}: victim({set}): expected a way from 0 to {last}, found {found}"
                ))
            })
        });
        way.unwrap_or(0)
    }
}
