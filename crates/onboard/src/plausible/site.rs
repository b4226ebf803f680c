//! What a site's file says by itself.

use std::f64::consts::TAU;

use super::hearing::steps_along;
use super::usual::{Usual, as_degrees, as_millimetres, rounded, unusual};
use super::warning::Warning;
use crate::geometry::{Point, cross};
use crate::road::Road;
use crate::settings::Site;

const ROWS: &[Usual] = &[
    Usual {
        // Half a metre for ground that is not quite even.
        key: "radio_heads[].position_m[2]",
        within: [-0.5, 100.0],
        why: "heights count from the ground that vehicles drive on, and masts of a plant are up to 60 m high",
        write: |it| {
            if it < 0.0 {
                format!("write metres above the ground, upwards: {}", -it)
            } else {
                format!(
                    "write metres above the ground, not above the sea: {it} mm are {}",
                    rounded(it / 1000.0)
                )
            }
        },
    },
    Usual {
        key: "radio_heads[].position_std_m",
        within: [0.0, 20.0],
        why: "a phone's GNSS is better",
        write: as_millimetres,
    },
    Usual {
        // 75 dBm per 100 MHz is the most that is licensed at 28 GHz (47 CFR 30.202).
        key: "radio_heads[].eirp_dbm",
        within: [-60.0, 80.0],
        why: "cells of a plant send 0 to 60 dBm, none more than 80",
        write: |it| {
            let dbm = 10.0 * it.max(1e-9).log10();
            format!("write dBm: {it} mW are {dbm:.1}")
        },
    },
    Usual {
        key: "radio_heads[].eirp_std_db",
        within: [0.0, 15.0],
        why: "nobody knows a transmitter as little",
        write: |_| "write dB, 1 to 6".to_owned(),
    },
    Usual {
        key: "road.width_m",
        within: [0.3, 60.0],
        why: "lanes are 1 to 10 m wide, aprons up to 60",
        write: as_millimetres,
    },
    Usual {
        key: "road.position_std_m",
        within: [0.0, 5.0],
        why: "a road in an aerial photograph is known better",
        write: as_millimetres,
    },
    Usual {
        key: "road.start.heading_rad",
        within: [-TAU, TAU],
        why: "that is more than a whole turn",
        write: as_degrees,
    },
    Usual {
        key: "road.segments[].turn_rad",
        within: [-TAU, TAU],
        why: "that is more than a whole turn, and the road would lie on itself",
        write: as_degrees,
    },
];

/// Where no NR cell is: the frequency ranges of TS 38.104, 5.1, in MHz.
const FR1_MHZ: [f64; 2] = [410.0, 7125.0];
const FR2_MHZ: [f64; 2] = [24_250.0, 71_000.0];

/// Farther than a local frame reaches, as grid coordinates are (m): UTM eastings begin at 166 km.
const LOCAL_M: f64 = 1e5;
/// Within so much all places of a plant lie where they are written in degrees: 0.3° are 33 km.
const DEGREES: f64 = 0.3;
/// Nearer than antennas of one mast stand to each other (m).
const SAME_PLACE_M: f64 = 0.05;
/// A road is followed in steps of so much, and at most so many (m).
const STEP_M: f64 = 1.0;
const MOST_STEPS: f64 = 2000.0;
/// No bend of a vehicle's road is as narrow (m).
const LEAST_RADIUS_M: f64 = 0.3;

/// What is doubtful of a site by itself, but for who hears whom.
pub(super) fn written(site: &Site, road: Option<&Road>) -> Vec<Warning> {
    let mut found = unusual(site, ROWS);
    found.extend(carrier(site));
    found.extend(coordinates(site, road));
    found.extend(indices(site));
    found.extend(twins(site));
    found.extend(bends(site));
    found.extend(road.into_iter().flat_map(|road| across(site, road)));
    found
}

fn carrier(site: &Site) -> Option<Warning> {
    let (mhz, khz) = (site.carrier_mhz, site.ssb.subcarrier_spacing_khz);
    let within = |[least, most]: [f64; 2]| (least..=most).contains(&mhz);
    if !within(FR1_MHZ) && !within(FR2_MHZ) {
        return Some(Warning {
            key: "carrier_mhz".to_owned(),
            value: mhz.to_string(),
            why: "no NR cell is there: frequency range 1 is 410 to 7125 MHz, 2 is 24250 to 71000 \
                  (TS 38.104, 5.1)"
                .to_owned(),
            write: "write the carrier in MHz: 3500".to_owned(),
        });
    }
    let (range, spacings) = if within(FR1_MHZ) {
        (1, [15.0, 30.0])
    } else {
        (2, [120.0, 240.0])
    };
    let [first, second] = spacings;
    (!spacings.contains(&khz)).then(|| Warning {
        key: "ssb.subcarrier_spacing_khz".to_owned(),
        value: khz.to_string(),
        why: format!(
            "at {mhz} MHz, frequency range {range}, SSBs have {first} or {second} kHz (TS 38.213, 4.1)"
        ),
        write: format!("write {first} or {second}"),
    })
}

fn coordinates(site: &Site, road: Option<&Road>) -> Option<Warning> {
    let heads: Vec<[f64; 2]> = (site.radio_heads.iter())
        .map(|head| [head.position_m[0], head.position_m[1]])
        .collect();
    let drawn = site.road.as_ref().and_then(|road| road.polyline_m.as_ref());
    let all = heads.iter().chain(drawn.into_iter().flatten());
    let warning = |key: &str, value: String, why: &str, write: &str| Warning {
        key: key.to_owned(),
        value,
        why: why.to_owned(),
        write: write.to_owned(),
    };
    let is_grid = |place: &&[f64; 2]| place.iter().any(|it| it.abs() > LOCAL_M);
    if let Some(place) = all.clone().find(is_grid) {
        let is_head = heads.iter().position(|head| head == place);
        let key = is_head.map_or_else(
            || "road.polyline_m".to_owned(),
            |index| format!("radio_heads[{index}].position_m"),
        );
        let [x_m, y_m] = place.map(f64::round);
        return Some(warning(
            &key,
            format!("{place:?}"),
            "these are coordinates of a map's grid (UTM, Gauss-Krüger), hundreds of kilometres from \
             its origin",
            &format!(
                "write metres from a point of the plant's own: take [{x_m}, {y_m}] from all x and y, \
                 of the road, too"
            ),
        ));
    }
    let extent = |places: &[[f64; 2]]| {
        [0, 1]
            .map(|axis| {
                let values = || places.iter().map(|place| place[axis]);
                values().fold(f64::MIN, f64::max) - values().fold(f64::MAX, f64::min)
            })
            .into_iter()
            .fold(0.0, f64::max)
    };
    let why = "places of a plant as near to each other are written in degrees";
    let write = "write metres east and north of a point of the plant's own; a degree of latitude is \
                 111195 m, one of longitude that times the cosine of the latitude";
    if heads.len() > 1 && extent(&heads) < DEGREES {
        let value = format!("{:?}", site.radio_heads[0].position_m);
        return Some(warning("radio_heads[0].position_m", value, why, write));
    }
    let length_m = road?.length_m();
    (length_m < 1.0).then(|| warning("road", format!("{length_m:.4} m long"), why, write))
}

/// SSB indices that bursts do not have at this carrier.
fn indices(site: &Site) -> Vec<Warning> {
    let (count, heads) = (site.ssb_indices(), site.radio_heads.iter().enumerate());
    let beyond = heads.filter(|(_, head)| head.ssb_index >= count);
    beyond
        .map(|(number, head)| Warning {
            key: format!("radio_heads[{number}].ssb_index"),
            value: head.ssb_index.to_string(),
            why: format!(
                "at {} MHz and {} kHz a burst has {count} SSBs (TS 38.213, 4.1)",
                site.carrier_mhz, site.ssb.subcarrier_spacing_khz
            ),
            write: format!("write 0 to {}", count - 1),
        })
        .collect()
}

/// Heads that are one head, or are called the same.
fn twins(site: &Site) -> Vec<Warning> {
    let mut found = Vec::new();
    let point = |position_m: [f64; 3]| Point::new(position_m[0], position_m[1]);
    for (index, head) in site.radio_heads.iter().enumerate() {
        for (earlier, other) in site.radio_heads.iter().take(index).enumerate() {
            let apart_m = point(head.position_m).distance_m(point(other.position_m));
            let apart_m = apart_m.hypot(head.position_m[2] - other.position_m[2]);
            if apart_m < SAME_PLACE_M {
                found.push(Warning {
                    key: format!("radio_heads[{index}].position_m"),
                    value: format!("{:?}", head.position_m),
                    why: format!("radio_heads[{earlier}] stands {apart_m:.3} m from there"),
                    write: "write each radio head's own place; leave out what is there twice"
                        .to_owned(),
                });
            }
            if !head.name.is_empty() && head.name == other.name {
                found.push(Warning {
                    key: format!("radio_heads[{index}].name"),
                    value: format!("{:?}", head.name),
                    why: format!("radio_heads[{earlier}] is called the same, and names are how others are told apart"),
                    write: format!("write another name: \"{}-{index}\"", head.name),
                });
            }
        }
    }
    found
}

/// Arcs narrower than any vehicle's, whose turn is in degrees.
fn bends(site: &Site) -> Vec<Warning> {
    let segments = site
        .road
        .iter()
        .flat_map(|road| road.segments.iter().flatten());
    let narrow = segments.enumerate().filter(|(_, it)| {
        // What turns more than once round has been said already.
        it.turn_rad.abs() <= TAU && it.length_m < LEAST_RADIUS_M * it.turn_rad.abs()
    });
    narrow
        .map(|(index, it)| Warning {
            key: format!("road.segments[{index}].turn_rad"),
            value: it.turn_rad.to_string(),
            why: format!(
                "over {} m that is a bend of {:.2} m radius, which no vehicle drives",
                it.length_m,
                it.length_m / it.turn_rad.abs()
            ),
            write: as_degrees(it.turn_rad),
        })
        .collect()
}

/// Walls that stand across the road.
fn across(site: &Site, road: &Road) -> Vec<Warning> {
    if site.walls.is_empty() {
        return Vec::new();
    }
    let way: Vec<(f64, Point)> = steps_along(road, STEP_M, MOST_STEPS).collect();
    let blocked_m = |ends: &[[f64; 2]]| {
        let wall = [ends[0].into(), ends[1].into()];
        let mut steps = way.windows(2);
        steps
            .find(|step| cross(wall, [step[0].1, step[1].1]))
            .map(|step| step[0].0)
    };
    let walls = site.walls.iter().enumerate();
    walls
        .filter_map(|(index, wall)| {
            let along_m = wall.points_m.windows(2).find_map(blocked_m)?;
            Some(Warning {
                key: format!("walls[{index}].points_m"),
                value: format!("a wall of {} points", wall.points_m.len()),
                why: format!("it stands across the road, {along_m:.0} m along it"),
                write: "write it in the frame of the road, and as two walls beside a door"
                    .to_owned(),
            })
        })
        .collect()
}
