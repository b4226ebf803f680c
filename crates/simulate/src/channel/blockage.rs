//! Blockage of the line of sight by walls and by moving objects.

use onboard::geometry::Point;
use onboard::walls::Walls;
use rand::RngExt;

use super::propagation::Link;
use crate::random::Purpose;
use crate::scenario::BlockageSettings;
use crate::world::LineOfSight;

/// Blockage of the line of sight of one link. Blockers arrive as a Poisson process in time, and the
/// duration of each blockage is exponentially distributed.
#[derive(Debug, Clone)]
pub struct Blockage {
    /// Start and end of each blockage in seconds, ordered by start.
    times_s: Vec<[f64; 2]>,
    amplitude: f64,
    walls: Walls,
    head: Point,
}

impl Blockage {
    /// Draws the blockage of a link.
    pub fn new(settings: Option<BlockageSettings>, link: &Link<'_>) -> Self {
        let (walls, head) = (Walls::new(link.site), link.radio_head());
        let head = head.map_or_else(Point::default, |head| head.position);
        let Some(settings) = settings else {
            return Self {
                times_s: Vec::new(),
                amplitude: 1.0,
                walls,
                head,
            };
        };
        let mut rng = link.streams.generator(Purpose::Blockage, link.head);
        let mut exponential = |mean_s: f64| -mean_s * (1.0 - rng.random::<f64>()).ln();
        let every_s = 60.0 / settings.per_minute;
        let mut times_s = Vec::new();
        let mut from_s = exponential(every_s);
        while from_s < link.duration_s {
            times_s.push([from_s, from_s + exponential(settings.duration_s)]);
            from_s += exponential(every_s);
        }
        Self {
            times_s,
            amplitude: 10f64.powf(-0.05 * settings.loss_db),
            walls,
            head,
        }
    }

    /// Returns the amplitude factor of the line of sight due to moving blockers and walls (0 to 1).
    pub fn amplitude(&self, sight: &LineOfSight) -> f64 {
        self.moving(sight.time_s) * self.walls.passing(self.head, sight.place).sqrt()
    }

    /// Returns the amplitude factor of the line of sight due to moving blockers only (0 to 1).
    pub fn moving(&self, time_s: f64) -> f64 {
        let begun = self
            .times_s
            .partition_point(|[from_s, _]| *from_s <= time_s);
        let begun = self.times_s.get(..begun).unwrap_or_default();
        if begun.iter().any(|[_, until_s]| time_s < *until_s) {
            self.amplitude
        } else {
            1.0
        }
    }
}
