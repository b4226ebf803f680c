//! Roads from survey files: CSV and GeoJSON.

use std::path::Path;

use onboard::settings::SettingsError;
use serde_json::Value;

use crate::error::RecordingError;
use crate::table::Table;
use crate::text::read_text;

/// A road of a million points.
const MOST_BYTES: u64 = 64 << 20;

/// Mean radius of the Earth in metres (IUGG); a road is short enough for a sphere.
const EARTH_RADIUS_M: f64 = 6_371_008.8;

/// No road of a plant reaches as far (m).
const PLANT_M: f64 = 100e3;

/// What to write where coordinates are no degrees.
const IN_METRES: &str = "coordinates in metres are read from CSV with the columns x_m,y_m, or where \
                         the file names their system: \"crs\": {\"type\": \"name\", \"properties\": \
                         {\"name\": \"urn:ogc:def:crs:EPSG::25832\"}}";

/// Reads the points of a road: the columns `x_m` and `y_m` of a CSV file, or a GeoJSON `LineString`
/// in metres where it says so, else projected onto the tangent plane of its first point.
///
/// # Errors
/// [`SettingsError`] naming the place in the file.
pub fn read_points_m(path: &Path) -> Result<Vec<[f64; 2]>, SettingsError> {
    let file = path.display().to_string();
    let text = read_text(path, MOST_BYTES)?;
    let is_json = path
        .extension()
        .is_some_and(|end| end.eq_ignore_ascii_case("geojson") || end.eq_ignore_ascii_case("json"));
    let points = if is_json {
        from_geojson(&text)
    } else {
        from_csv(&text)
    };
    points.map_err(|(key, message)| SettingsError::Shape { file, key, message })
}

/// Place in the file and what is wrong there.
type Defect = (String, String);

fn from_csv(text: &str) -> Result<Vec<[f64; 2]>, Defect> {
    let columns = ["x_m", "y_m"];
    let table = Table::parse(text, Path::new(""), &columns, &[]).map_err(|error| {
        let message = match error {
            RecordingError::Missing { allowed, .. } => allowed,
            other => other.to_string(),
        };
        ("header".to_owned(), message)
    })?;
    let rows = table.rows.into_iter();
    rows.map(|row| {
        let point = row.values.and_then(|values| match *values.as_slice() {
            [Some(x_m), Some(y_m)] if x_m.is_finite() && y_m.is_finite() => Ok([x_m, y_m]),
            _ => Err("`x_m` and `y_m` must be finite numbers".to_owned()),
        });
        point.map_err(|message| (format!("line {}", row.line), message))
    })
    .collect()
}

/// The first `LineString`: longitude and latitude, to metres east and north of its first point; metres
/// as they are where the file names a projected system (`crs`, as GIS write it).
fn from_geojson(text: &str) -> Result<Vec<[f64; 2]>, Defect> {
    let defect = |key: &str, message: &str| (key.to_owned(), message.to_owned());
    let json: Value = serde_json::from_str(text).map_err(|e| defect("JSON", &e.to_string()))?;
    let line = line_string(&json)
        .ok_or_else(|| defect("geometry", "a geometry of type `LineString` is needed"))?;
    let mut places = Vec::with_capacity(line.len());
    for (index, place) in line.iter().enumerate() {
        let number = |axis: usize| place.get(axis).and_then(Value::as_f64);
        let (Some(first), Some(second)) = (number(0), number(1)) else {
            let key = format!("coordinates[{index}]");
            return Err((key, "it must be two numbers".to_owned()));
        };
        places.push([first, second]);
    }
    if is_projected(&json) {
        return Ok(places);
    }
    let Some(&[longitude_0, latitude_0]) = places.first() else {
        return Err(defect("coordinates", "at least two points are needed"));
    };
    for (index, place) in places.iter().enumerate() {
        if let Some(why) = not_degrees(*place) {
            let message = format!("[{}, {}] {why}; {IN_METRES}", place[0], place[1]);
            return Err((format!("coordinates[{index}]"), message));
        }
    }
    let metres_per_degree = EARTH_RADIUS_M.to_radians();
    let shrink = latitude_0.to_radians().cos();
    let points: Vec<[f64; 2]> = (places.iter())
        .map(|[longitude, latitude]| {
            let east_m = (longitude - longitude_0) * metres_per_degree * shrink;
            [east_m, (latitude - latitude_0) * metres_per_degree]
        })
        .collect();
    let farthest_m = (points.iter()).fold(0.0, |most: f64, [x_m, y_m]| most.max(x_m.hypot(*y_m)));
    if farthest_m > PLANT_M {
        let message = format!(
            "read as degrees the road reaches {:.0} km from its first point; {IN_METRES}",
            farthest_m / 1000.0
        );
        return Err(("coordinates".to_owned(), message));
    }
    Ok(points)
}

/// Why a place is no longitude and latitude of a plant. Swapped, those of Asia and America have
/// latitudes beyond 72°, and those of Europe lie off the Horn of Africa.
fn not_degrees([longitude, latitude]: [f64; 2]) -> Option<String> {
    const SWAPPED: &str = "if latitude and longitude are swapped, write [longitude, latitude]";
    if longitude.abs() > 180.0 || latitude.abs() > 90.0 {
        let swapped = longitude.abs() <= 90.0 && latitude.abs() <= 180.0;
        let hint = if swapped { SWAPPED } else { "" };
        let comma = if swapped { ", " } else { "" };
        return Some(format!(
            "is no [longitude, latitude] in degrees{comma}{hint}"
        ));
    }
    let is_polar = !(-60.0..=72.0).contains(&latitude);
    let off_somalia = (41.0..=60.0).contains(&longitude) && (-6.0..=16.0).contains(&latitude);
    (is_polar || off_somalia).then(|| {
        let place = if is_polar {
            "in the polar ice"
        } else {
            "off the Horn of Africa"
        };
        format!("is {place}, {SWAPPED}")
    })
}

/// Whether the file says that its coordinates are metres: it names another system than WGS 84.
fn is_projected(json: &Value) -> bool {
    let name = json.pointer("/crs/properties/name").and_then(Value::as_str);
    name.is_some_and(|name| {
        let degrees = ["CRS84", "4326", "4258", "4979"];
        !degrees.iter().any(|it| name.ends_with(it))
    })
}

fn line_string(json: &Value) -> Option<&Vec<Value>> {
    match json.get("type")?.as_str()? {
        "LineString" => json.get("coordinates")?.as_array(),
        "Feature" => line_string(json.get("geometry")?),
        "FeatureCollection" => json
            .get("features")?
            .as_array()?
            .iter()
            .find_map(line_string),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn csv_columns_are_found_by_name() {
        let points = from_csv("name,y_m,x_m\na,2,1\nb,4,3\n").unwrap();
        assert_eq!(points, vec![[1.0, 2.0], [3.0, 4.0]]);
    }

    #[test]
    fn bad_csv_names_the_line() {
        assert_eq!(from_csv("x,y\n1,2\n").unwrap_err().0, "header");
        assert_eq!(from_csv("x_m,y_m\n1,2\n3,nan\n").unwrap_err().0, "line 3");
        let told = from_csv("x_m,y_m\n1,5,2,5\n").unwrap_err();
        assert!(
            told.0 == "line 2" && told.1.contains("semicolons"),
            "{told:?}"
        );
    }

    #[test]
    fn a_german_csv_has_semicolons_and_decimal_commas() {
        let points = from_csv("\u{feff}name;x_m;y_m\r\na;1,5;-2\r\nb;3;4,25\r\n").unwrap();
        assert_eq!(points, vec![[1.5, -2.0], [3.0, 4.25]]);
        let told = from_csv("x_m;y_m\n1,5;2\n1.234;2\n").unwrap_err();
        assert!(told.1.contains("ambiguous"), "{told:?}");
    }

    #[test]
    fn geojson_that_is_not_in_degrees_is_refused_with_what_to_write() {
        let line = |coordinates: &str| {
            from_geojson(&format!(
                r#"{{"type":"LineString","coordinates":{coordinates}}}"#
            ))
        };
        for (coordinates, write) in [
            ("[[0.0,0.0],[120.0,95.0]]", "x_m,y_m"),
            ("[[0.0,0.0],[80.0,40.0]]", "x_m,y_m"),
            ("[[32500000.0,5540000.0],[32500100.0,5540000.0]]", "EPSG"),
            ("[[50.11,8.68],[50.12,8.68]]", "[longitude, latitude]"),
            ("[[41.88,-87.63],[41.88,-87.62]]", "[longitude, latitude]"),
            ("[[31.23,121.47],[31.24,121.47]]", "[longitude, latitude]"),
        ] {
            let (key, message) = line(coordinates).unwrap_err();
            assert!(key.starts_with("coordinates"), "{key}");
            assert!(message.contains(write), "{coordinates}: {message}");
        }
        for place in [
            "8.68,50.11",
            "121.47,31.23",
            "-87.63,41.88",
            "20.2,67.85",
            "55.27,25.2",
        ] {
            let told = line(&format!("[[{place}],[{place}]]"));
            assert!(told.is_ok(), "{told:?}");
        }
    }

    #[test]
    fn geojson_becomes_metres() {
        let text = r#"{"type":"Feature","properties":{},"geometry":
            {"type":"LineString","coordinates":[[8.0,60.0],[8.001,60.0],[8.001,60.001]]}}"#;
        let points = from_geojson(text).unwrap();
        assert!((points[1][0] - 55.597).abs() < 0.01 && points[1][1].abs() < 1e-9);
        assert!((points[2][1] - 111.195).abs() < 0.01);
        let metres = text.replacen(
            "\"type\"",
            r#""crs":{"type":"name","properties":{"name":"EPSG:25832"}},"type""#,
            1,
        );
        assert_eq!(from_geojson(&metres).unwrap()[2], [8.001, 60.001]);
        let point = r#"{"type":"Point","coordinates":[8,60]}"#;
        assert_eq!(from_geojson(point).unwrap_err().0, "geometry");
    }
}
