//! A field and its damage.

use super::trace::Trace;
use formats::textrace::{SUBTEXELS, Tables};
use parallax_tests::repair::Parts;

/// The sound capture.
pub struct Sound {
    pub bytes: Vec<u8>,
    pub trace: Trace,
}

/// Makes the damaged file.
pub type Change = Box<dyn Fn(&Sound) -> Vec<u8> + Send + Sync>;

/// A field and its damage: one change, or the same change in ascending sizes.
pub struct Damage {
    pub field: String,
    pub sizes: Vec<(String, Change)>,
}

/// Changes a part of the trace, which is written anew.
pub fn damage(
    field: &str,
    what: &str,
    change: impl Fn(&mut Trace) + Send + Sync + 'static,
) -> Damage {
    Damage {
        field: field.into(),
        sizes: vec![(what.into(), changed(change))],
    }
}

fn changed(change: impl Fn(&mut Trace) + Send + Sync + 'static) -> Change {
    Box::new(move |sound: &Sound| {
        let mut trace = sound.trace.clone();
        change(&mut trace);
        trace.bytes()
    })
}

/// Changes bytes of chunks; the checksums of chunks and tiles are correct afterwards.
pub fn of_bytes(
    field: &str,
    what: &str,
    change: impl Fn(&mut Parts) + Send + Sync + 'static,
) -> Damage {
    let apply = move |sound: &Sound| {
        let mut parts = Parts::of(&sound.bytes);
        change(&mut parts);
        parts.sealed()
    };
    Damage {
        field: field.into(),
        sizes: vec![(what.into(), Box::new(apply))],
    }
}

/// Changes bytes of the file, without new checksums.
pub fn of_file(
    field: &str,
    what: &str,
    change: impl Fn(&mut Vec<u8>) + Send + Sync + 'static,
) -> Damage {
    let apply = move |sound: &Sound| {
        let mut bytes = sound.bytes.clone();
        change(&mut bytes);
        bytes
    };
    Damage {
        field: field.into(),
        sizes: vec![(what.into(), Box::new(apply))],
    }
}

pub fn of_tables(
    field: &str,
    what: &str,
    change: impl Fn(&mut Tables) + Send + Sync + 'static,
) -> Damage {
    damage(field, what, move |trace| change(&mut trace.tables))
}

/// Changes by 1, 2, 4 ... 1024 steps of 1/2048 texel.
pub fn by_texels(
    field: &str,
    whose: &str,
    change: impl Fn(&mut Trace, i32) + Clone + Send + Sync + 'static,
) -> Damage {
    let sizes = (0..=10).map(|power| {
        let (steps, change) = (1 << power, change.clone());
        let change = changed(move |trace| change(trace, steps));
        (format!("{whose} + {steps}/{SUBTEXELS} texel"), change)
    });
    Damage {
        field: field.into(),
        sizes: sizes.collect(),
    }
}

/// Changes by 1e-8, 1e-7 ... 1 of a unit.
pub fn by_tenths(
    field: &str,
    unit: &str,
    change: impl Fn(&mut Tables, f32) + Clone + Send + Sync + 'static,
) -> Damage {
    let sizes = (-8..=0).map(|power| {
        let change = change.clone();
        let apply = changed(move |trace| change(&mut trace.tables, 10.0_f32.powi(power)));
        (format!("+ 1e{power}{unit}"), apply)
    });
    Damage {
        field: field.into(),
        sizes: sizes.collect(),
    }
}
