//! Rigid poses in double precision.

use crate::state::Code;
use glam::{DQuat, DVec3};
use openxr_sys as xr;
use spool::openxr as settings;

/// A rotation and a translation: from a space to the one that it is given in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pose {
    pub turn: DQuat,
    pub place: DVec3,
}

/// Largest difference of a quaternion's length from 1.
const UNIT_TOLERANCE: f64 = 0.01;

impl Pose {
    pub const IDENTITY: Self = Self {
        turn: DQuat::IDENTITY,
        place: DVec3::ZERO,
    };

    /// The pose of a program.
    ///
    /// # Errors
    /// A quaternion whose length is not 1, or a number that is not finite.
    pub fn of_program(pose: &xr::Posef) -> Result<Self, Code> {
        let (q, p) = (pose.orientation, pose.position);
        let turn = DQuat::from_array([q.x, q.y, q.z, q.w].map(f64::from));
        let place = DVec3::from_array([p.x, p.y, p.z].map(f64::from));
        let is_unit = (turn.length() - 1.0).abs() <= UNIT_TOLERANCE;
        match is_unit && place.is_finite() {
            // Identity stays exact.
            true if turn == DQuat::IDENTITY => Ok(Self { turn, place }),
            true => Ok(Self {
                turn: turn.normalize(),
                place,
            }),
            false => Err(Code::ERROR_POSE_INVALID),
        }
    }

    pub fn of_settings(pose: &settings::Pose) -> Self {
        Self {
            turn: DQuat::from_array(pose.orientation),
            place: DVec3::from_array(pose.position_m),
        }
    }

    /// The pose in single precision.
    pub fn to_program(self) -> xr::Posef {
        let [x, y, z, w] = self.turn.to_array().map(|part| part as f32);
        let place = self.place.as_vec3();
        xr::Posef {
            orientation: xr::Quaternionf { x, y, z, w },
            position: xr::Vector3f {
                x: place.x,
                y: place.y,
                z: place.z,
            },
        }
    }

    /// First `inner`, then this pose. An identity leaves the other one as it is.
    pub fn then(self, inner: Self) -> Self {
        match (self == Self::IDENTITY, inner == Self::IDENTITY) {
            (true, _) => inner,
            (_, true) => self,
            _ => Self {
                turn: (self.turn * inner.turn).normalize(),
                place: self.place + self.turn * inner.place,
            },
        }
    }

    pub fn inverse(self) -> Self {
        let turn = self.turn.conjugate();
        Self {
            turn,
            place: -(turn * self.place),
        }
    }

    /// The pose between two poses.
    pub fn between(self, other: Self, part: f64) -> Self {
        if part == 0.0 {
            return self;
        }
        Self {
            turn: self.turn.slerp(other.turn, part),
            place: self.place.lerp(other.place, part),
        }
    }

    /// The upright pose at the same place and with the same heading.
    pub fn upright(self) -> Self {
        let ahead = self.turn * DVec3::NEG_Z;
        let level = DVec3::new(ahead.x, 0.0, ahead.z);
        let turn = match level.length() > 1e-6 {
            true => DQuat::from_rotation_y((-level.x).atan2(-level.z)),
            false => DQuat::IDENTITY,
        };
        Self { turn, ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pose_after_its_inverse_is_the_identity() {
        let pose = Pose {
            turn: DQuat::from_rotation_y(0.3) * DQuat::from_rotation_x(-1.0),
            place: DVec3::new(1.0, -2.0, 3.0),
        };
        for both in [pose.then(pose.inverse()), pose.inverse().then(pose)] {
            assert!(both.place.length() < 1e-12, "{both:?}");
            assert!(
                both.turn.dot(DQuat::IDENTITY).abs() > 1.0 - 1e-12,
                "{both:?}"
            );
        }
        assert_eq!(Pose::IDENTITY.then(pose), pose);
        assert_eq!(pose.then(Pose::IDENTITY), pose);
    }

    #[test]
    fn the_upright_pose_keeps_the_heading() {
        let yaw = DQuat::from_rotation_y(0.7);
        let pose = Pose {
            turn: yaw * DQuat::from_rotation_x(-0.5),
            place: DVec3::X,
        };
        let upright = pose.upright();
        assert!(upright.turn.dot(yaw).abs() > 1.0 - 1e-12);
        assert_eq!(upright.place, DVec3::X);
    }

    #[test]
    fn quaternions_of_programs_have_length_1() {
        let with = |w| xr::Posef {
            orientation: xr::Quaternionf {
                x: 0.0,
                y: 0.0,
                z: 0.0,
                w,
            },
            ..xr::Posef::IDENTITY
        };
        assert_eq!(Pose::of_program(&with(1.0)), Ok(Pose::IDENTITY));
        for bad in [0.0, 0.98, 1.02, f32::NAN] {
            assert_eq!(Pose::of_program(&with(bad)), Err(Code::ERROR_POSE_INVALID));
        }
    }
}
