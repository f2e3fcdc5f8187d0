//! What stands for the numbers that pass between limbs and trunk.

/// A number that passes between the trunk and limbs in all modes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Crossing {
    /// What a sweep hands on at node `node`, by the sweep and a number: outward from the trunk, inward from a limb.
    Carried { node: usize, value: [usize; 2] },
    /// Multiplier of a loop or rate of a shared coordinate.
    Unknown { level: usize, unknown: usize },
}

/// What a symbol stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Symbol {
    /// Number `entry` of what the `place`-th of the limbs that touch hands to the trunk.
    Handed { place: usize, entry: usize },
    /// A number that a limb hands to the trunk in all of its modes.
    FromLimb(Crossing),
    /// A number of the trunk.
    Trunk(Crossing),
    /// The multiplier of a row of a contact, in a limb.
    Multiplier { level: usize, unknown: usize },
    /// Number `entry` of what the `place`-th of the limbs that touch gives back to the trunk for the end.
    Returned { place: usize, entry: usize },
    /// A number that a limb gives back in all of its modes.
    BackFromLimb(Crossing),
}

/// What a value depends on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Class {
    /// On what limbs have handed to the trunk.
    pub handed: bool,
    /// On the solution of the trunk.
    pub late: bool,
    /// On what limbs have given back.
    pub returned: bool,
    /// On the modes of these groups, one bit each, by what is theirs alone.
    pub groups: u64,
}

impl Class {
    /// Whether it is known before the trunk.
    pub fn is_early(self) -> bool {
        !self.handed && !self.late && !self.returned
    }
}
