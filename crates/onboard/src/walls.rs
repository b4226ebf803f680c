//! Walls that obstruct lines of sight.
//!
//! A wall attenuates the direct wave by its penetration loss; scatter is not attenuated. If the
//! direct wave is weaker than the scatter, the angles contain no information about the radio head,
//! which then counts as out of sight. Walls are higher than any line of sight.

use std::sync::Arc;

use crate::geometry::{Point, cross};
use crate::radio_head::RadioHead;
use crate::settings::Site;

/// Walls of a site.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Walls {
    segments: Arc<[Segment]>,
    rician_k: f64,
}

/// Straight wall.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Segment {
    from: Point,
    to: Point,
    loss_db: f64,
}

impl Walls {
    /// Creates the walls of a site.
    pub fn new(site: &Site) -> Self {
        let segments = site.walls.iter().flat_map(|wall| {
            let loss_db = wall.loss_db.unwrap_or_else(|| concrete_db(site));
            wall.polyline_m
                .windows(2)
                .filter_map(move |ends| match ends {
                    &[from, to] => Some(Segment {
                        from: from.into(),
                        to: to.into(),
                        loss_db,
                    }),
                    _ => None,
                })
        });
        Self {
            segments: segments.collect(),
            rician_k: 10f64.powf(0.1 * site.rician_k_db),
        }
    }

    /// Whether the site has no walls.
    pub fn is_empty(&self) -> bool {
        self.segments.is_empty()
    }

    /// Returns the fraction of the direct wave's power that passes all walls between two positions;
    /// 1 without walls.
    pub fn passing(&self, from: Point, to: Point) -> f64 {
        let blocking = self.segments.iter();
        let blocking = blocking.filter(|wall| cross([from, to], [wall.from, wall.to]));
        10f64.powf(-0.1 * blocking.fold(0.0, |sum, wall| sum + wall.loss_db))
    }

    /// Returns a radio head with its EIRP reduced by the walls between it and a position; `None` if
    /// it is out of sight.
    pub fn seen(&self, head: &RadioHead, place: Point) -> Option<RadioHead> {
        if self.is_empty() {
            return Some(*head);
        }
        let (k, passing) = (self.rician_k, self.passing(head.position, place));
        (passing == 1.0 || k * passing >= 1.0).then(|| RadioHead {
            eirp_dbm: head.eirp_dbm + 10.0 * ((k * passing + 1.0) / (k + 1.0)).log10(),
            array: None,
            ..*head
        })
    }
}

/// Returns the penetration loss of concrete at a site's carrier (TR 38.901, table 7.4.3-1).
fn concrete_db(site: &Site) -> f64 {
    5.0 + 4.0 * 1e-3 * site.carrier_mhz
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::{Shipped, TomlFile, WallSettings};

    #[test]
    fn a_concrete_wall_blocks_a_radio_head_and_glass_attenuates_it() {
        let mut site = Site::from_library("yard", &Shipped).unwrap();
        let head = RadioHead {
            position: Point::new(0.0, 10.0),
            ..RadioHead::from(&site.radio_heads[0])
        };
        let (behind, outside) = (Point::new(0.0, -10.0), Point::new(40.0, 5.0));
        assert_eq!(Walls::new(&site).seen(&head, behind), Some(head));

        site.rician_k_db = 10.0;
        let polyline_m = vec![[-5.0, 0.0], [5.0, 0.0], [5.0, -20.0]];
        let wall = |loss_db| WallSettings {
            name: String::new(),
            polyline_m: polyline_m.clone(),
            loss_db,
        };
        site.walls = vec![wall(None)];
        let concrete = Walls::new(&site);
        // 5 + 4 · 3.5 dB, and twice that through two walls of the building.
        let passing_db = |to| 10.0 * concrete.passing(head.position, to).log10();
        assert!((passing_db(behind) + 19.0).abs() < 1e-9);
        assert!((passing_db(Point::new(6.0, -4.0)) + 38.0).abs() < 1e-9);
        assert_eq!(concrete.seen(&head, behind), None);
        assert_eq!(concrete.seen(&head, outside), Some(head));

        site.walls = vec![wall(Some(3.0))];
        let seen = Walls::new(&site).seen(&head, behind).unwrap();
        // (10 / 10^0.3 + 1) / 11
        assert!((seen.eirp_dbm - head.eirp_dbm + 2.624).abs() < 1e-3);
    }
}
