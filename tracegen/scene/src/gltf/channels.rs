//! The channels of animations: their targets and their curves.

use super::accessors::{Buffers, at};
use crate::SceneError;
use crate::animation::{Channel, Curve, Interpolation, WeightCurve};
use crate::files::Origin;
use crate::warnings::Warnings;
use glam::DVec4;
use gltf::json::Root;
use gltf::json::animation::{Interpolation as JsonInterpolation, Property, Sampler};
use gltf::json::validation::Checked;
use std::collections::HashMap;
use std::fmt::Display;

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

impl Target<'_> {
    /// The keys of the channel.
    pub fn keys<'a>(&'a self, buffers: &'a Buffers<'a>) -> Keys<'a> {
        Keys {
            buffers,
            channel: &self.place,
            sampler: self.sampler,
        }
    }
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

/// A channel's sampler, named in errors.
pub(super) struct Keys<'a> {
    buffers: &'a Buffers<'a>,
    channel: &'a str,
    sampler: &'a Sampler,
}

impl Keys<'_> {
    fn invalid<T>(&self, expected: String, found: String) -> Result<T, SceneError> {
        let place = format!("{}, its sampler", self.channel);
        Err(self.buffers.origin.invalid(place, expected, found))
    }

    /// Interpolation, times and values, of which a key has `of_key`.
    fn read<const N: usize, T: Display>(
        &self,
        (what, of_key): (&'static str, usize),
        value: impl Fn([f64; N]) -> T,
        is_finite: impl Fn(&T) -> bool,
        warnings: &mut Warnings,
    ) -> Result<(Interpolation, Vec<f64>, Vec<T>), SceneError> {
        let (interpolation, times_s) = self.times(warnings)?;
        let floats = self.buffers.floats::<N>(at(&self.sampler.output), what)?;
        let values: Vec<T> = (floats.into_iter())
            .map(|floats| value(floats.map(f64::from)))
            .collect();
        let expected = times_s.len() * of_key * interpolation.values_per_key();
        if values.len() != expected {
            let expected = format!("{expected} values for {} times", times_s.len());
            return self.invalid(expected, values.len().to_string());
        }
        if let Some(key) = values.iter().position(|value| !is_finite(value)) {
            let found = format!("{} at {key}", values[key]);
            return self.invalid("finite values".to_owned(), found);
        }
        Ok((interpolation, times_s, values))
    }

    /// The interpolation and times of the keys.
    fn times(&self, warnings: &mut Warnings) -> Result<(Interpolation, Vec<f64>), SceneError> {
        let interpolation = match self.sampler.interpolation {
            Checked::Valid(JsonInterpolation::Linear) => Interpolation::Linear,
            Checked::Valid(JsonInterpolation::Step) => Interpolation::Step,
            Checked::Valid(JsonInterpolation::CubicSpline) => Interpolation::Cubic,
            Checked::Invalid => {
                let expected = "LINEAR, STEP or CUBICSPLINE interpolation".to_owned();
                return self.invalid(expected, "another".to_owned());
            }
        };
        let times = self
            .buffers
            .floats::<1>(at(&self.sampler.input), "times: scalar floats")?;
        let times_s: Vec<f64> = times.iter().map(|[time]| f64::from(*time)).collect();
        let ascending = times_s.is_sorted() && times_s.iter().all(|t| t.is_finite());
        if times_s.is_empty() || !ascending {
            return self.invalid(
                "at least one time, finite and ascending".to_owned(),
                format!("{} times that are not", times_s.len()),
            );
        }
        let equal = times_s.windows(2).filter(|pair| pair[0] == pair[1]).count();
        if equal > 0 {
            warnings.count("equal times", || {
            let channel = self.channel;
            format!("{channel}: {equal} keys have the time of the key before; the last one counts from then on")
        });
        }
        Ok((interpolation, times_s))
    }

    /// Reads the curve of a channel that moves a node.
    pub fn curve(&self, channel: Channel, warnings: &mut Warnings) -> Result<Curve, SceneError> {
        let is_finite = |value: &DVec4| value.is_finite();
        let (interpolation, times_s, values) = if channel == Channel::Rotation {
            let what = "rotations: vectors of 4 floats";
            self.read((what, 1), DVec4::from_array, is_finite, warnings)?
        } else {
            let wide = |[x, y, z]: [f64; 3]| DVec4::new(x, y, z, 0.0);
            self.read(("vectors of 3 floats", 1), wide, is_finite, warnings)?
        };
        // Each value of a cubic curve is stored between its two tangents.
        let a_key = interpolation.values_per_key();
        let of_keys = || values.iter().skip(a_key / 2).step_by(a_key);
        let unit = |q: &&DVec4| (q.length() - 1.0).abs() <= 1e-2;
        if channel == Channel::Rotation && of_keys().count() != of_keys().filter(unit).count() {
            return self.invalid(
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
    pub fn weights(
        &self,
        targets: usize,
        warnings: &mut Warnings,
    ) -> Result<WeightCurve, SceneError> {
        let of_key = ("weights: scalar floats", targets);
        let is_finite = |weight: &f64| weight.is_finite();
        let (interpolation, times_s, values) =
            self.read(of_key, |[weight]| weight, is_finite, warnings)?;
        Ok(WeightCurve {
            interpolation,
            times_s,
            values,
            targets,
        })
    }
}
