//! The place of an access, and the classification of reuses by it.

use formats::view::Eye;

/// The place of an access.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Place {
    /// Number of the tile, below [`Place::MOST_TILES`].
    pub tile: u32,
    /// The eye of the tile.
    pub eye: Option<Eye>,
    /// Row of the tile in the picture of its eye; none in other passes.
    pub row: Option<u32>,
    /// Number of the work item (one tile, or tiles rendered together), ascending in time.
    pub item: u32,
    /// Tiles of the work item: 1 or 2.
    pub tiles: u32,
}

impl Place {
    /// Maximum number of tiles.
    pub const MOST_TILES: u32 = 1 << 30;
}

/// Tile and eye in one word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct TileOfEye(u32);

impl TileOfEye {
    pub(crate) const NONE: Self = Self(0);

    pub(crate) fn of(place: &Place) -> Self {
        let eye = match place.eye {
            None => 0,
            Some(Eye::Left) => 1,
            Some(Eye::Right) => 2,
        };
        Self(place.tile << 2 | eye)
    }

    /// 0 for the left eye, 1 for the right.
    #[inline(always)]
    pub(crate) fn eye(self) -> Option<usize> {
        (self.0 & 3).checked_sub(1).map(|eye| eye as usize)
    }
}

/// Location of the previous use of a reused line. The first that applies counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// In an earlier frame.
    EarlierFrame,
    /// In this frame, in a tile of the other eye.
    OtherEye,
    /// In this frame, in another tile.
    OtherTile,
    /// In the same tile.
    SameTile,
}

impl Origin {
    /// All locations, in the order of [`ByOrigin`].
    pub const ALL: [Self; 4] = [
        Self::SameTile,
        Self::OtherTile,
        Self::OtherEye,
        Self::EarlierFrame,
    ];

    /// Name in columns.
    pub fn key(self) -> &'static str {
        match self {
            Self::SameTile => "same_tile",
            Self::OtherTile => "other_tile",
            Self::OtherEye => "other_eye",
            Self::EarlierFrame => "earlier_frame",
        }
    }

    /// Index into [`ByOrigin`].
    #[inline(always)]
    pub fn index(self) -> usize {
        match self {
            Self::SameTile => 0,
            Self::OtherTile => 1,
            Self::OtherEye => 2,
            Self::EarlierFrame => 3,
        }
    }

    /// Classifies a reuse at `now` of a line previously used at `before`.
    #[inline(always)]
    pub(crate) fn of(before: TileOfEye, in_this_frame: bool, now: TileOfEye) -> Self {
        if !in_this_frame {
            Self::EarlierFrame
        } else if before == now {
            Self::SameTile
        } else {
            match (before.eye(), now.eye()) {
                (Some(before), Some(now)) if before != now => Self::OtherEye,
                _ => Self::OtherTile,
            }
        }
    }
}

/// Counts by location of the previous use; see [`Origin::index`].
pub type ByOrigin = [u64; 4];

/// Adds counts.
pub(crate) fn add(to: &mut ByOrigin, from: &ByOrigin) {
    for (to, from) in to.iter_mut().zip(from) {
        *to += from;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tile(tile: u32, eye: Option<Eye>) -> TileOfEye {
        TileOfEye::of(&Place {
            tile,
            eye,
            ..Place::default()
        })
    }

    #[test]
    fn origins_rank_earlier_frame_before_other_eye_before_other_tile() {
        let (left, right) = (Some(Eye::Left), Some(Eye::Right));
        let now = tile(7, right);
        for (before, in_this_frame, expected) in [
            (now, true, Origin::SameTile),
            (now, false, Origin::EarlierFrame),
            (tile(6, right), true, Origin::OtherTile),
            (tile(3, left), true, Origin::OtherEye),
            (tile(3, left), false, Origin::EarlierFrame),
            (tile(3, None), true, Origin::OtherTile),
        ] {
            assert_eq!(Origin::of(before, in_this_frame, now), expected);
        }
    }

    #[test]
    fn indexes_equal_positions_in_the_list() {
        for (index, origin) in Origin::ALL.into_iter().enumerate() {
            assert_eq!(origin.index(), index);
        }
    }
}
