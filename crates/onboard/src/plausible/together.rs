//! Plausibility of a site together with a vehicle.

use super::hearing::{with_interference, without_reception, without_reception_at_start};
use super::site::written;
use super::usual::rounded;
use super::vehicle::of_vehicle;
use super::warning::Warning;
use crate::road::Road;
use crate::settings::{LocalizerSettings, Shipped, Site, TomlFile, Vehicle};

/// Returns the warnings of a site, with the reception of a default vehicle.
pub fn of_site(site: &Site) -> Vec<Warning> {
    let road = site.build_road().ok().flatten();
    let Ok(vehicle) = Vehicle::from_library("default", &Shipped) else {
        return written(site, road.as_ref()); // it is shipped
    };
    let mut found = in_reach(site, &vehicle, road.as_ref());
    found.extend(with_interference(site, &vehicle, road.as_ref()));
    found
}

/// Returns the warnings of a site and a vehicle before a drive. Keys begin with `site` and
/// `vehicle`.
pub fn of_site_and_vehicle(site: &Site, vehicle: &Vehicle) -> Vec<Warning> {
    let road = site.build_road().ok().flatten();
    with_path_prefix("site", in_reach(site, vehicle, road.as_ref()))
        .chain(with_path_prefix("vehicle", on_site(site, vehicle)))
        .collect()
}

/// Returns the warnings of a site and a vehicle for a recorded path. Interference is not checked,
/// because the recording shows it.
pub fn of_site_and_vehicle_along(site: &Site, vehicle: &Vehicle, route: &Road) -> Vec<Warning> {
    let mut of_site = in_reach(site, vehicle, Some(route));
    of_site.extend(with_interference(site, vehicle, Some(route)));
    with_path_prefix("site", of_site)
        .chain(with_path_prefix("vehicle", on_site(site, vehicle)))
        .collect()
}

fn with_path_prefix(path: &str, found: Vec<Warning>) -> impl Iterator<Item = Warning> {
    found.into_iter().map(move |it| it.with_path_prefix(path))
}

/// Returns the warnings of the site, and of radio heads that are received nowhere on the path.
fn in_reach(site: &Site, vehicle: &Vehicle, route: Option<&Road>) -> Vec<Warning> {
    let mut found = written(site, route);
    // Positions in degrees or grid coordinates already have a warning.
    let of_places = |it: &Warning| it.key.ends_with("position_m") || it.key.starts_with("road");
    if !found.iter().any(of_places) {
        found.extend(without_reception(site, vehicle, route));
    }
    found
}

/// Returns the warnings of the vehicle, alone and at the site.
fn on_site(site: &Site, vehicle: &Vehicle) -> Vec<Warning> {
    let mut found = of_vehicle(vehicle);
    found.extend(spacing_in_metres(site, vehicle));
    found.extend(
        start_off_road(site, vehicle).or_else(|| without_reception_at_start(site, vehicle)),
    );
    found.extend(lane_keeping_exceeds_road(site, vehicle));
    found.extend(one_head_only(site, vehicle));
    found.extend(below_array(site, vehicle));
    found
}

/// Returns a warning if all radio heads have height 0 and the array is above it. A model in a plane
/// has no heights.
fn below_array(site: &Site, vehicle: &Vehicle) -> Option<Warning> {
    let height_m = vehicle.array.position_m[2];
    let is_flat = site.radio_heads.iter().all(|it| it.position_m[2] == 0.0);
    (is_flat && height_m > 0.0).then(|| Warning {
        key: "array.position_m[2]".to_owned(),
        value: height_m.to_string(),
        why: "all radio heads are at height 0, as in a drawing without heights".to_owned(),
        write:
            "write the height of each radio head above the ground, in metres, as third number of \
                its position_m"
                .to_owned(),
    })
}

/// Returns a warning for several radio heads with a localizer that uses one.
fn one_head_only(site: &Site, vehicle: &Vehicle) -> Option<Warning> {
    let heads = site.radio_heads.len();
    let takes_one = matches!(vehicle.localizer, LocalizerSettings::DeadReckoning(_));
    (takes_one && heads > 1).then(|| Warning {
        key: "localizer.kind".to_owned(),
        value: "dead-reckoning".to_owned(),
        why: format!(
            "dead reckoning supports one radio head, as in the paper; the site has {heads}, and the \
             error of the heading jumps from one to the next"
        ),
        write: "write kind = \"tracker\", or a site with one radio head".to_owned(),
    })
}

/// Returns a warning if the antenna spacing is half a wavelength in metres. Below 3 GHz that number
/// is also a plausible spacing in wavelengths.
fn spacing_in_metres(site: &Site, vehicle: &Vehicle) -> Option<Warning> {
    let (spacing, half_m) = (vehicle.array.spacing_wavelengths, 0.5 * site.wavelength_m());
    let is_metres = (spacing / half_m - 1.0).abs() < 0.05 && spacing < 0.45;
    is_metres.then(|| Warning {
        key: "array.spacing_wavelengths".to_owned(),
        value: spacing.to_string(),
        why: format!(
            "half a wavelength at {} MHz is {half_m:.4} m, and antennas at this spacing are coupled",
            site.carrier_mhz
        ),
        write: format!(
            "specify wavelengths: {spacing} m are {:.2}",
            spacing / site.wavelength_m()
        ),
    })
}

/// Returns a warning if the start is farther from the followed road than its uncertainty permits.
fn start_off_road(site: &Site, vehicle: &Vehicle) -> Option<Warning> {
    let (pose, road) = (vehicle.start.pose?, site.build_road().ok().flatten()?);
    let projection = road.project(pose.point());
    let road_distance_m = road
        .pose(projection.along_m.clamp(0.0, road.length_m()))
        .point()
        .distance_m(pose.point());
    let may_m = road.width_m() + 3.0 * vehicle.start.position_std_m + 10.0;
    (vehicle.follows_road() && road_distance_m > may_m).then(|| Warning {
        key: "start.pose".to_owned(),
        value: format!("[{}, {}]", pose.x_m, pose.y_m),
        why: format!("that is {road_distance_m:.0} m from the road that the vehicle follows"),
        write:
            "write it in metres in the frame of the road, or drive = \"differential\" if it roams"
                .to_owned(),
    })
}

/// Returns a warning if the lane keeping leaves the road.
fn lane_keeping_exceeds_road(site: &Site, vehicle: &Vehicle) -> Option<Warning> {
    let (rms_m, width_m) = (vehicle.lane_keeping.rms_m, site.road.as_ref()?.width_m);
    (vehicle.follows_road() && rms_m > 0.5 * width_m).then(|| Warning {
        key: "lane_keeping.rms_m".to_owned(),
        value: rms_m.to_string(),
        why: format!(
            "the road is {width_m} m wide: the vehicle would be off the road a third \
             of the time"
        ),
        write: format!("write metres: {rms_m} cm are {}", rounded(rms_m / 100.0)),
    })
}
