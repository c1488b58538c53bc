//! Instances that move: pure functions of time, with no displacement at time 0.

use crate::Scene;
use glam::{Affine3A, Quat, Vec3};
use std::f32::consts::TAU;

/// Instances that move together.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Motion {
    /// Indices into the scene's instances; an instance belongs to one motion at most.
    pub instances: Vec<usize>,
    /// The movements that apply to them, outermost first: a crane's bridge, then the trolley on it.
    pub movements: Vec<Movement>,
}

/// A movement in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Movement {
    /// Back and forth, slowing down at both ends.
    Shuttle {
        /// Displacement from one end to the other, metres.
        by: Vec3,
        /// Seconds per round trip.
        period_s: f32,
        /// Position at time 0: 0 at one end, 0.5 at the other, 1 back at the first.
        phase: f32,
    },
    /// Rotation about an axis.
    Turn {
        /// A point of the axis at time 0, in the frame of the outer movements, metres.
        pivot: Vec3,
        /// Direction, unit length. Positive rotation follows the right hand.
        axis: Vec3,
        /// Turns per second.
        turns_per_s: f32,
    },
}

impl Movement {
    /// Displacement relative to time 0.
    pub fn transform(&self, time_s: f32) -> Affine3A {
        match *self {
            Self::Shuttle {
                by,
                period_s,
                phase,
            } => {
                let way = |t: f32| 0.5 - 0.5 * (TAU * (t / period_s + phase)).cos();
                Affine3A::from_translation(by * (way(time_s) - way(0.0)))
            }
            Self::Turn {
                pivot,
                axis,
                turns_per_s,
            } => {
                let turn = Quat::from_axis_angle(axis, TAU * (turns_per_s * time_s).fract());
                Affine3A::from_rotation_translation(turn, pivot - turn * pivot)
            }
        }
    }
}

impl Motion {
    /// Displacement of its instances relative to time 0, world space.
    pub fn transform(&self, time_s: f32) -> Affine3A {
        let product = |outer, movement: &Movement| outer * movement.transform(time_s);
        self.movements.iter().fold(Affine3A::IDENTITY, product)
    }
}

impl Scene {
    /// Whether any part of the scene moves.
    pub fn moves(&self) -> bool {
        !self.motions.is_empty() || self.animation.is_some()
    }

    /// The moving instances, each with its object-to-world transform at a time. At time 0 it equals
    /// the transform in [`Scene::instances`].
    pub fn moved(&self, time_s: f32) -> impl Iterator<Item = (usize, Affine3A)> + '_ {
        self.motions.iter().flat_map(move |motion| {
            let moved = motion.transform(time_s);
            let place =
                move |&index: &usize| Some((index, moved * self.instances.get(index)?.transform));
            motion.instances.iter().filter_map(place)
        })
    }

    /// Applies the transforms of a time to the moving instances.
    pub fn pose(&mut self, time_s: f32) {
        let moved: Vec<(usize, Affine3A)> = self.moved(time_s).collect();
        for (index, transform) in moved {
            self.instances[index].transform = transform;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Instance;

    fn close(a: Vec3, b: Vec3) {
        assert!((a - b).length() < 1e-5, "{a} {b}");
    }

    #[test]
    fn a_shuttle_is_at_its_ends_after_half_and_whole_periods() {
        let shuttle = |phase| Movement::Shuttle {
            by: Vec3::X * 10.0,
            period_s: 4.0,
            phase,
        };
        let at = |phase, t| shuttle(phase).transform(t).transform_point3(Vec3::ZERO);
        close(at(0.0, 0.0), Vec3::ZERO);
        close(at(0.0, 1.0), Vec3::X * 5.0);
        close(at(0.0, 2.0), Vec3::X * 10.0);
        close(at(0.0, 4.0), Vec3::ZERO);
        // From the far end it returns.
        close(at(0.5, 0.0), Vec3::ZERO);
        close(at(0.5, 2.0), Vec3::X * -10.0);
    }

    #[test]
    fn an_inner_movement_turns_about_an_axis_that_the_outer_one_moves() {
        let scene = Scene {
            instances: vec![
                Instance {
                    mesh: 0,
                    transform: Affine3A::from_translation(Vec3::new(2.0, 0.0, 0.0)),
                };
                2
            ],
            motions: vec![Motion {
                instances: vec![1],
                movements: vec![
                    Movement::Shuttle {
                        by: Vec3::Z * 8.0,
                        period_s: 2.0,
                        phase: 0.0,
                    },
                    Movement::Turn {
                        pivot: Vec3::X,
                        axis: Vec3::Y,
                        turns_per_s: 0.25,
                    },
                ],
            }],
            ..Scene::default()
        };
        let at = |t: f32| -> Vec<(usize, Vec3)> {
            let place = |(index, pose): (usize, Affine3A)| (index, pose.translation.into());
            scene.moved(t).map(place).collect()
        };
        assert_eq!(at(0.0), [(1, Vec3::new(2.0, 0.0, 0.0))]);
        // A quarter turn about (1, 0, 0) takes (2, 0, 0) to (1, 0, -1). The outer movement adds 8
        // m.
        close(at(1.0)[0].1, Vec3::new(1.0, 0.0, 7.0));
        let mut posed = scene.clone();
        posed.pose(1.0);
        close(
            posed.instances[1].transform.translation.into(),
            Vec3::new(1.0, 0.0, 7.0),
        );
        assert_eq!(posed.instances[0].transform, scene.instances[0].transform);
    }
}
