//! Map on the web page.

use onboard::settings::{Check, Site};
use serde_json::{Value, json};

/// Distance between points of the road's centre line (m).
const STEP_M: f64 = 1.0;
/// Maximum number of points of the centre line.
const MOST: usize = 4000;

/// Returns the road and the radio heads as JSON.
pub fn site_json(site: &Site, node: &str) -> Value {
    let road = site.road.as_ref();
    let road = road.and_then(|it| it.build("road", Check { file: &site.name }).ok());
    let line: Vec<[f64; 2]> = road.as_ref().map_or_else(Vec::new, |road| {
        let steps = ((road.length_m() / STEP_M).ceil() as usize).clamp(1, MOST);
        let places = (0..=steps).map(|step| step as f64 / steps as f64 * road.length_m());
        places
            .map(|along_m| {
                let pose = road.pose(along_m);
                [pose.x_m, pose.y_m]
            })
            .collect()
    });
    let heads = site.radio_heads.iter().map(|head| {
        json!({
            "name": head.name, "pci": head.pci, "ssb_index": head.ssb_index,
            "x_m": head.position_m[0], "y_m": head.position_m[1],
        })
    });
    json!({
        "node": node,
        "site": site.name,
        "road_m": line,
        "road_width_m": road.map(|it| it.width_m()),
        "heads": heads.collect::<Vec<Value>>(),
    })
}
