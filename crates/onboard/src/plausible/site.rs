//! Plausibility of a site file.

use std::f64::consts::TAU;

use super::hearing::steps_along;
use super::usual::{Usual, as_centimetres, as_degrees, as_millimetres, rounded, unusual};
use super::warning::Warning;
use crate::geometry::{Point, cross};
use crate::road::Road;
use crate::settings::Site;

const ROWS: &[Usual] = &[
    Usual {
        // Half a metre below zero, because the ground may be uneven.
        key: "radio_heads[].position_m[2]",
        within: [-0.5, 100.0],
        why: "heights are relative to the ground that vehicles drive on, and masts of a plant are at most 60 m high",
        write: |it| {
            if it < 0.0 {
                format!("specify metres above the ground, positive upwards: {}", -it)
            } else {
                format!(
                    "specify metres above the ground, not above sea level: {it} mm are {}",
                    rounded(it / 1000.0)
                )
            }
        },
    },
    Usual {
        key: "radio_heads[].position_std_m",
        within: [0.0, 3.0],
        why: "larger than the error of a map or of a phone's GNSS",
        write: as_centimetres,
    },
    Usual {
        // The maximum licensed EIRP at 28 GHz is 75 dBm per 100 MHz (47 CFR 30.202).
        key: "radio_heads[].eirp_dbm",
        within: [-60.0, 80.0],
        why: "the EIRP of cells in a plant is 0 to 60 dBm, and at most 80 dBm",
        write: |it| {
            let dbm = 10.0 * it.max(1e-9).log10();
            format!("specify dBm: {it} mW are {dbm:.1}")
        },
    },
    Usual {
        key: "radio_heads[].eirp_std_db",
        within: [0.0, 12.0],
        why: "larger than the uncertainty of any transmitter",
        write: |it| {
            format!(
                "write dB, 1 to 6: a standard deviation of {it} % is {:.1} dB",
                10.0 * (1.0 + it / 100.0).log10()
            )
        },
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
        why: "larger than the error of a road in an aerial photograph",
        write: as_centimetres,
    },
    Usual {
        key: "road.start.heading_rad",
        within: [-TAU, TAU],
        why: "more than a full turn",
        write: as_degrees,
    },
    Usual {
        key: "road.segments[].turn_rad",
        within: [-TAU, TAU],
        why: "more than a full turn, so that the road would cross itself",
        write: as_degrees,
    },
];

/// NR frequency range FR1 in MHz (TS 38.104, 5.1).
const FR1_MHZ: [f64; 2] = [410.0, 7125.0];
/// NR frequency range FR2 in MHz (TS 38.104, 5.1).
const FR2_MHZ: [f64; 2] = [24_250.0, 71_000.0];

/// Maximum coordinate of a local frame (m). Grid coordinates are larger: UTM eastings start at 166
/// km.
const LOCAL_M: f64 = 1e5;
/// Maximum extent of a plant whose coordinates are in degrees: 0.3° correspond to 33 km.
const DEGREES: f64 = 0.3;
/// Minimum distance between antennas of one mast (m).
const SAME_PLACE_M: f64 = 0.05;
/// Step along the road (m).
const STEP_M: f64 = 1.0;
/// Maximum number of steps along the road.
const MAX_STEPS: f64 = 2000.0;
/// Minimum bend radius of a vehicle's road (m).
const MIN_RADIUS_M: f64 = 0.3;

/// Returns the warnings of a site, without those of reception.
pub(super) fn written(site: &Site, road: Option<&Road>) -> Vec<Warning> {
    let mut found = unusual(site, ROWS);
    found.extend(carrier(site));
    found.extend(coordinates(site, road));
    found.extend(indices(site));
    found.extend(duplicate_heads(site));
    found.extend(bends(site));
    found.extend(road.into_iter().flat_map(|road| across(site, road)));
    found.extend(road.into_iter().flat_map(|road| other_side(site, road)));
    found
}

fn carrier(site: &Site) -> Option<Warning> {
    let (mhz, khz) = (site.carrier_mhz, site.ssb.subcarrier_spacing_khz);
    let within = |[least, most]: [f64; 2]| (least..=most).contains(&mhz);
    if !within(FR1_MHZ) && !within(FR2_MHZ) {
        return Some(Warning {
            key: "carrier_mhz".to_owned(),
            value: mhz.to_string(),
            why: "outside the NR bands: frequency range 1 is 410 to 7125 MHz, 2 is 24250 to 71000 \
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
            "these are grid coordinates (UTM, Gauss-Krüger), hundreds of kilometres from \
             its origin",
            &format!(
                "specify metres relative to a point of the plant: subtract [{x_m}, {y_m}] from all x and y, \
                 including those of the road"
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
    let why = "positions of a plant this close together are probably in degrees";
    let write = "specify metres east and north of a point of the plant; a degree of latitude is \
                 111195 m, a degree of longitude that times the cosine of the latitude";
    if heads.len() > 1 && extent(&heads) < DEGREES {
        let value = format!("{:?}", site.radio_heads[0].position_m);
        return Some(warning("radio_heads[0].position_m", value, why, write));
    }
    let length_m = road?.length_m();
    (length_m < 1.0).then(|| warning("road", format!("{length_m:.4} m long"), why, write))
}

/// Returns warnings for SSB indices that do not exist at this carrier.
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

/// Returns warnings for radio heads with identical positions or names.
fn duplicate_heads(site: &Site) -> Vec<Warning> {
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
                    why: format!("radio_heads[{earlier}] is {apart_m:.3} m from this position"),
                    write: "specify the position of each radio head once; remove duplicates"
                        .to_owned(),
                });
            }
            if !head.name.is_empty() && head.name == other.name {
                found.push(Warning {
                    key: format!("radio_heads[{index}].name"),
                    value: format!("{:?}", head.name),
                    why: format!(
                        "radio_heads[{earlier}] has the same name, and names identify radio heads"
                    ),
                    write: format!("write another name: \"{}-{index}\"", head.name),
                });
            }
        }
    }
    found
}

/// Returns warnings for arcs with a radius below that of any vehicle, whose heading change is
/// probably in degrees.
fn bends(site: &Site) -> Vec<Warning> {
    let segments = site
        .road
        .iter()
        .flat_map(|road| road.segments.iter().flatten());
    let narrow = segments.enumerate().filter(|(_, it)| {
        // Heading changes above one turn have a separate warning.
        it.turn_rad.abs() <= TAU && it.length_m < MIN_RADIUS_M * it.turn_rad.abs()
    });
    narrow
        .map(|(index, it)| Warning {
            key: format!("road.segments[{index}].turn_rad"),
            value: it.turn_rad.to_string(),
            why: format!(
                "over {} m this is a bend of {:.2} m radius, which no vehicle can drive",
                it.length_m,
                it.length_m / it.turn_rad.abs()
            ),
            write: as_degrees(it.turn_rad),
        })
        .collect()
}

/// Distance along the road on either side of a radio head for which line of sight is expected (m).
const NEXT_TO_M: f64 = 60.0;

/// Returns warnings for radio heads that walls hide from the nearby road, and that would have line
/// of sight on the other side of the road.
fn other_side(site: &Site, road: &Road) -> Vec<Warning> {
    if site.walls.is_empty() {
        return Vec::new();
    }
    let route: Vec<(f64, Point)> = steps_along(road, STEP_M, MAX_STEPS).collect();
    let is_hidden = |from: Point, to: Point| {
        let mut walls = site
            .walls
            .iter()
            .flat_map(|wall| wall.polyline_m.windows(2));
        walls.any(|ends| cross([from, to], [ends[0].into(), ends[1].into()]))
    };
    // Returns the fraction of the road around the distance `about_m` that walls hide from a
    // position.
    let hidden_share = |from: Point, about_m: f64| {
        let near = route
            .iter()
            .filter(|(along_m, _)| (along_m - about_m).abs() <= NEXT_TO_M);
        let (count, hidden) = near.fold((0.0, 0.0), |(count, hidden), (_, point)| {
            (
                count + 1.0,
                hidden + f64::from(u8::from(is_hidden(from, *point))),
            )
        });
        if count > 0.0 { hidden / count } else { 0.0 }
    };
    let heads = site.radio_heads.iter().enumerate();
    heads
        .filter_map(|(index, head)| {
            let [x_m, y_m, z_m] = head.position_m;
            let place = Point::new(x_m, y_m);
            let projection = road.project(place);
            let nearest = road
                .pose(projection.along_m.clamp(0.0, road.length_m()))
                .point();
            let mirrored = Point::new(2.0 * nearest.x_m - x_m, 2.0 * nearest.y_m - y_m);
            let is_doubtful = hidden_share(place, projection.along_m) > 0.9
                && hidden_share(mirrored, projection.along_m) < 0.1;
            is_doubtful.then(|| Warning {
                key: format!("radio_heads[{index}].position_m"),
                value: format!("{:?}", head.position_m),
                why: format!(
                    "walls hide the road from it: it is {:.0} m to the {} of the road",
                    projection.lateral_m.abs(),
                    if projection.lateral_m > 0.0 {
                        "left"
                    } else {
                        "right"
                    }
                ),
                write: format!(
                    "write [{:.1}, {:.1}, {z_m}] if it is on the other side of the road",
                    mirrored.x_m, mirrored.y_m
                ),
            })
        })
        .collect()
}

/// Returns warnings for walls that cross the road.
fn across(site: &Site, road: &Road) -> Vec<Warning> {
    if site.walls.is_empty() {
        return Vec::new();
    }
    let route: Vec<(f64, Point)> = steps_along(road, STEP_M, MAX_STEPS).collect();
    let blocked_m = |ends: &[[f64; 2]]| {
        let wall = [ends[0].into(), ends[1].into()];
        let mut steps = route.windows(2);
        steps
            .find(|step| cross(wall, [step[0].1, step[1].1]))
            .map(|step| step[0].0)
    };
    let walls = site.walls.iter().enumerate();
    walls
        .filter_map(|(index, wall)| {
            let along_m = wall.polyline_m.windows(2).find_map(blocked_m)?;
            Some(Warning {
                key: format!("walls[{index}].polyline_m"),
                value: format!("a wall of {} points", wall.polyline_m.len()),
                why: format!("it crosses the road at {along_m:.0} m along the road"),
                write: "specify it in the frame of the road, and as two walls with a gap at a door"
                    .to_owned(),
            })
        })
        .collect()
}
