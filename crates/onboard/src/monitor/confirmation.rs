//! Confirmation of a given or resumed pose by angles.

/// Number of accepted angles minus rejected ones that confirms a pose. At a wrong position, one
/// angle is accepted by chance with a probability of a few percent (the width of its gate). Five of
/// them are not.
const CONFIRMING_ANGLES: u32 = 5;

/// Minimum number of different radio heads among the accepted angles, if the site has as many. One
/// radio head confirms a direction only.
const CONFIRMING_HEADS: usize = 2;

/// Confirmation state of a pose: whether angles have confirmed it, and the evidence collected so
/// far.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Confirmation {
    is_confirmed: bool,
    score: u32,
    pcis: [Option<u16>; CONFIRMING_HEADS],
    needed_heads: usize,
}

impl Confirmation {
    /// Creates the state of a pose that was found by angles (`is_confirmed`) or given, at a site
    /// with `heads` radio heads.
    pub fn new(is_confirmed: bool, heads: usize) -> Self {
        Self {
            is_confirmed,
            score: 0,
            pcis: [None; CONFIRMING_HEADS],
            needed_heads: heads.min(CONFIRMING_HEADS),
        }
    }

    /// Whether the pose is confirmed.
    pub const fn is_confirmed(&self) -> bool {
        self.is_confirmed
    }

    /// Records that the pose was found by angles.
    pub const fn confirm(&mut self) {
        self.is_confirmed = true;
    }

    /// Discards the confirmation, so that the pose must be confirmed again.
    pub fn restart(&mut self) {
        *self = Self::new(false, self.needed_heads);
    }

    /// Adds the verdict on an angle to a radio head.
    pub fn angle(&mut self, pci: u16, is_accepted: bool) {
        if !is_accepted {
            self.score = self.score.saturating_sub(1);
            return;
        }
        self.score = self.score.saturating_add(1);
        let free = |it: &&mut Option<u16>| it.is_none_or(|it| it == pci);
        if let Some(place) = self.pcis.iter_mut().find(free) {
            *place = Some(pci);
        }
        let heads = self.pcis.iter().flatten().count();
        self.is_confirmed |= self.score >= CONFIRMING_ANGLES && heads >= self.needed_heads;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn five_angles_of_two_radio_heads_confirm_and_outliers_do_not() {
        let mut pose = Confirmation::new(false, 4);
        for _ in 0..20 {
            pose.angle(11, true);
        }
        assert!(!pose.is_confirmed());
        pose.angle(12, true);
        assert!(pose.is_confirmed());
        pose.restart();
        for number in 0..100 {
            pose.angle(11 + number % 2, number % 3 == 0);
        }
        assert!(!pose.is_confirmed());
        let mut alone = Confirmation::new(false, 1);
        for number in 0..5 {
            assert!(!alone.is_confirmed(), "{number}");
            alone.angle(11, true);
        }
        assert!(alone.is_confirmed());
        assert!(Confirmation::new(true, 4).is_confirmed());
    }
}
