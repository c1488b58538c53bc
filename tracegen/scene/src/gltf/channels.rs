//! The channels of animations: their targets and their curves.

use super::accessors::{Buffers, at};
use crate::SceneError;
use crate::animation::{Channel, Curve, Interpolation, WeightCurve};
use crate::files::Origin;
use crate::warnings::Warnings;
use glam::{DVec3, DVec4};
use gltf::json::Root;
use gltf::json::animation::{Interpolation as JsonInterpolation, Property, Sampler};
use gltf::json::validation::Checked;
use std::collections::HashMap;

/// The property of a node that a channel animates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Moved {
    /// A part of its transform.
    Joint(Channel),
    /// The weights of its mesh's morph targets.
    Weights,
}

impl Moved {
    fn name(self) -> &'static str {
        match self {
            Self::Joint(Channel::Translation) => "translation",
            Self::Joint(Channel::Rotation) => "rotation",
            Self::Joint(Channel::Scale) => "scale",
            Self::Weights => "weights",
        }
    }
}

/// A channel of a node.
pub(super) struct Target<'a> {
    pub moved: Moved,
    /// Its place in the file.
    pub place: String,
    pub sampler: &'a Sampler,
}

/// The channels of each node in the given animations.
pub(super) fn targets<'a>(
    root: &'a Root,
    animations: impl IntoIterator<Item = usize>,
    origin: &Origin,
) -> Result<HashMap<usize, Vec<Target<'a>>>, SceneError> {
    let mut targets: HashMap<usize, Vec<Target<'_>>> = HashMap::new();
    for a in animations {
        let animation = &root.animations[a];
        for (c, channel) in animation.channels.iter().enumerate() {
            let place = format!("animations[{a}].channels[{c}]");
            let moved = match channel.target.path {
                Checked::Valid(Property::Translation) => Moved::Joint(Channel::Translation),
                Checked::Valid(Property::Rotation) => Moved::Joint(Channel::Rotation),
                Checked::Valid(Property::Scale) => Moved::Joint(Channel::Scale),
                Checked::Valid(Property::MorphTargetWeights) => Moved::Weights,
                Checked::Invalid => continue,
            };
            let node = at(&channel.target.node);
            // The crate checks a channel's sampler but not its target.
            let (Some(sampler), true) = (
                animation.samplers.get(at(&channel.sampler)),
                node < root.nodes.len(),
            ) else {
                return Err(origin.invalid(
                    format!("{place}.target.node"),
                    format!("one of {} nodes", root.nodes.len()),
                    node.to_string(),
                ));
            };
            let others = targets.entry(node).or_default();
            if others.iter().any(|other| other.moved == moved) {
                return Err(origin.invalid(
                    place,
                    format!("one channel for the {} of nodes[{node}]", moved.name()),
                    "a second one",
                ));
            }
            others.push(Target {
                moved,
                place,
                sampler,
            });
        }
    }
    Ok(targets)
}

/// The place of a channel's sampler, for errors.
struct Place<'a> {
    origin: &'a Origin,
    channel: &'a str,
}

impl Place<'_> {
    fn invalid<T>(&self, expected: String, found: String) -> Result<T, SceneError> {
        let place = format!("{}, its sampler", self.channel);
        Err(self.origin.invalid(place, expected, found))
    }

    /// Checks the number of values against the number of keys.
    fn check_count(
        &self,
        found: usize,
        of_key: usize,
        interpolation: Interpolation,
        times_s: &[f64],
    ) -> Result<(), SceneError> {
        let expected = times_s.len() * of_key * interpolation.values_per_key();
        if found == expected {
            return Ok(());
        }
        let expected = format!("{expected} values for {} times", times_s.len());
        self.invalid(expected, found.to_string())
    }
}

/// The interpolation and times of the keys.
fn keys(
    buffers: &Buffers<'_>,
    place: &Place<'_>,
    sampler: &Sampler,
    warnings: &mut Warnings,
) -> Result<(Interpolation, Vec<f64>), SceneError> {
    let interpolation = match sampler.interpolation {
        Checked::Valid(JsonInterpolation::Linear) => Interpolation::Linear,
        Checked::Valid(JsonInterpolation::Step) => Interpolation::Step,
        Checked::Valid(JsonInterpolation::CubicSpline) => Interpolation::Cubic,
        Checked::Invalid => {
            let expected = "LINEAR, STEP or CUBICSPLINE interpolation".to_owned();
            return place.invalid(expected, "another".to_owned());
        }
    };
    let times = buffers.floats::<1>(at(&sampler.input), "times: scalar floats")?;
    let times_s: Vec<f64> = times.iter().map(|[time]| f64::from(*time)).collect();
    let ascending = times_s.is_sorted() && times_s.iter().all(|t| t.is_finite());
    if times_s.is_empty() || !ascending {
        return place.invalid(
            "at least one time, finite and ascending".to_owned(),
            format!("{} times that are not", times_s.len()),
        );
    }
    let equal = times_s.windows(2).filter(|pair| pair[0] == pair[1]).count();
    if equal > 0 {
        warnings.count("equal times", || {
            let channel = place.channel;
            format!("{channel}: {equal} keys have the time of the key before; the last one counts from then on")
        });
    }
    Ok((interpolation, times_s))
}

/// Reads the curve of a channel that moves a node.
pub(super) fn curve(
    buffers: &Buffers<'_>,
    place: &str,
    channel: Channel,
    sampler: &Sampler,
    warnings: &mut Warnings,
) -> Result<Curve, SceneError> {
    let place = Place {
        origin: buffers.origin,
        channel: place,
    };
    let (interpolation, times_s) = keys(buffers, &place, sampler, warnings)?;
    let values: Vec<DVec4> = if channel == Channel::Rotation {
        let values = buffers.floats::<4>(at(&sampler.output), "rotations: vectors of 4 floats")?;
        values
            .into_iter()
            .map(|q| DVec4::from_array(q.map(f64::from)))
            .collect()
    } else {
        let values = buffers.floats::<3>(at(&sampler.output), "vectors of 3 floats")?;
        let wide = |v: [f32; 3]| DVec3::from_array(v.map(f64::from)).extend(0.0);
        values.into_iter().map(wide).collect()
    };
    place.check_count(values.len(), 1, interpolation, &times_s)?;
    if let Some(key) = values.iter().position(|value| !value.is_finite()) {
        return place.invalid(
            "finite values".to_owned(),
            format!("{} at {key}", values[key]),
        );
    }
    // Each value of a cubic curve is stored between its two tangents.
    let a_key = interpolation.values_per_key();
    let keys = || values.iter().skip(a_key / 2).step_by(a_key);
    let unit = |q: &&DVec4| (q.length() - 1.0).abs() <= 1e-2;
    if channel == Channel::Rotation && keys().count() != keys().filter(unit).count() {
        return place.invalid(
            "unit quaternions (a length of 1, to 0.01)".to_owned(),
            "another length".to_owned(),
        );
    }
    Ok(Curve {
        interpolation,
        times_s,
        values,
    })
}

/// Reads the curve of a channel that animates the weights of morph targets.
pub(super) fn weight_curve(
    buffers: &Buffers<'_>,
    place: &str,
    targets: usize,
    sampler: &Sampler,
    warnings: &mut Warnings,
) -> Result<WeightCurve, SceneError> {
    let place = Place {
        origin: buffers.origin,
        channel: place,
    };
    let (interpolation, times_s) = keys(buffers, &place, sampler, warnings)?;
    let values = buffers.floats::<1>(at(&sampler.output), "weights: scalar floats")?;
    let values: Vec<f64> = values.iter().map(|[weight]| f64::from(*weight)).collect();
    place.check_count(values.len(), targets, interpolation, &times_s)?;
    if let Some(key) = values.iter().position(|value| !value.is_finite()) {
        return place.invalid(
            "finite values".to_owned(),
            format!("{} at {key}", values[key]),
        );
    }
    Ok(WeightCurve {
        interpolation,
        times_s,
        values,
        targets,
    })
}
