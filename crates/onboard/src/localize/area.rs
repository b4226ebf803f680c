//! A rectangle of the plane, to be searched.

use crate::geometry::Point;
use crate::radio_head::RadioHead;

/// A rectangle along the axes of the map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Area {
    from: Point,
    to: Point,
}

impl Area {
    /// The square with this middle.
    pub fn around(middle: Point, half_side_m: f64) -> Self {
        Self {
            from: Point::new(middle.x_m - half_side_m, middle.y_m - half_side_m),
            to: Point::new(middle.x_m + half_side_m, middle.y_m + half_side_m),
        }
    }

    /// Where the radio heads are, and a quarter of that to each side.
    pub fn of_heads(heads: &[RadioHead]) -> Self {
        let bounds = |along: fn(&RadioHead) -> f64| {
            let values = || heads.iter().map(along);
            let least = values().fold(f64::INFINITY, f64::min);
            let most = values().fold(f64::NEG_INFINITY, f64::max);
            (least, most)
        };
        let (west, east) = bounds(|head| head.position.x_m);
        let (south, north) = bounds(|head| head.position.y_m);
        let margin_m = 0.25 * (east - west).max(north - south);
        Self {
            from: Point::new(west - margin_m, south - margin_m),
            to: Point::new(east + margin_m, north + margin_m),
        }
    }

    /// Distance between places of which there are at most so many, but at least `least_m`.
    pub fn spacing_m(&self, most_places: f64, least_m: f64) -> f64 {
        let square_m2 = (self.to.x_m - self.from.x_m) * (self.to.y_m - self.from.y_m);
        (square_m2 / most_places).sqrt().max(least_m)
    }

    /// The middles of its squares.
    pub fn places(&self, spacing_m: f64) -> impl Iterator<Item = Point> {
        let count = move |length_m: f64| (length_m / spacing_m).ceil().max(1.0) as u32;
        let middle = move |number: u32| (f64::from(number) + 0.5) * spacing_m;
        let (from, to) = (self.from, self.to);
        let (columns, rows) = (count(to.x_m - from.x_m), count(to.y_m - from.y_m));
        (0..columns).flat_map(move |column| {
            (0..rows).map(move |row| Point::new(from.x_m + middle(column), from.y_m + middle(row)))
        })
    }
}
