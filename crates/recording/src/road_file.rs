//! Roads from survey files in CSV and GeoJSON format.

use std::path::Path;

use onboard::settings::SettingsError;
use serde_json::Value;

use crate::error::RecordingError;
use crate::table::Table;
use crate::text::read_text;

/// Maximum size of a road file in bytes, about a million points.
const MAX_BYTES: u64 = 64 << 20;

/// Semi-major axis of the WGS 84 ellipsoid in metres (EPSG:7030).
const SEMI_MAJOR_M: f64 = 6_378_137.0;

/// Squared eccentricity of the WGS 84 ellipsoid.
const ECCENTRICITY_SQUARED: f64 = 6.694_379_990_141_317e-3;

/// EPSG codes of longitude and latitude whose ellipsoids differ from WGS 84 by less than a
/// millimetre: WGS 84, ETRS89, NAD83, SIRGAS 2000, GDA94, GDA2020, NZGD2000.
const IN_DEGREES: [u32; 9] = [4326, 4979, 4258, 4269, 4674, 4283, 7844, 9057, 4167];

/// EPSG codes of grids whose scale error is below 1/1000: UTM of WGS 84, ETRS89 and NAD83, MGA,
/// Gauss-Krüger, and national grids of Switzerland, Britain, the Netherlands, France and New
/// Zealand.
const GRIDS: [std::ops::RangeInclusive<u32>; 13] = [
    32601..=32660,
    32701..=32760,
    25828..=25838,
    26901..=26923,
    28348..=28358,
    7846..=7859,
    31466..=31469,
    2056..=2056,
    21781..=21781,
    27700..=27700,
    28992..=28992,
    2154..=2154,
    2193..=2193,
];

/// Maximum extent of a plant's road (m).
const PLANT_M: f64 = 100e3;

/// Advice for coordinates that are not in degrees.
const IN_METRES: &str = "coordinates in metres are read from CSV with the columns x_m,y_m, or where \
                         the file names their system: \"crs\": {\"type\": \"name\", \"properties\": \
                         {\"name\": \"urn:ogc:def:crs:EPSG::25832\"}}";

/// Reads the points of a road: the columns `x_m` and `y_m` of a CSV file, or a GeoJSON
/// `LineString`. GeoJSON coordinates are in metres if the file names such a system. Otherwise they
/// are projected to the tangent plane of the first point.
///
/// # Errors
/// [`SettingsError`] with the position in the file.
pub fn read_points_m(path: &Path) -> Result<Vec<[f64; 2]>, SettingsError> {
    let file = path.display().to_string();
    let text = read_text(path, MAX_BYTES)?;
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

/// Position in the file, and description of the defect.
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

/// Reads the first `LineString` in metres. Longitude and latitude are converted to metres east and
/// north of the first point on the tangent plane of the ellipsoid. Metres are unchanged if the file
/// names a grid of [`GRIDS`] or the frame of the plant.
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
    if system(&json)? == System::Metres {
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
    let plane = TangentPlane::new(longitude_0, latitude_0);
    let points: Vec<[f64; 2]> = places.iter().map(|place| plane.metres(*place)).collect();
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

/// Returns the reason why a point is not the longitude and latitude of a plant. With exchanged
/// coordinates, points in Asia and America have latitudes above 72°, and points in Europe are near
/// the Horn of Africa.
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
    let is_swapped_europe = (41.0..=60.0).contains(&longitude) && (-6.0..=16.0).contains(&latitude);
    (is_polar || is_swapped_europe).then(|| {
        let place = if is_polar {
            "in the polar ice"
        } else {
            "off the Horn of Africa"
        };
        format!("is {place}, {SWAPPED}")
    })
}

/// Unit of a file's coordinates.
#[derive(Debug, PartialEq, Eq)]
enum System {
    Degrees,
    Metres,
}

/// Returns the reference system of the member `crs` (GeoJSON 2008); degrees without one, or with `null`.
fn system(json: &Value) -> Result<System, Defect> {
    let Some(crs) = json.get("crs").filter(|it| !it.is_null()) else {
        return Ok(System::Degrees);
    };
    let unknown = |what: &str| {
        let message = format!(
            "{what} is not supported; allowed are longitude and latitude (no `crs`), grids such as \
             UTM, and urn:ogc:def:crs:OGC::Engineering for metres of the plant's own frame; \
             `access-av file new site NAME.toml --road FILE` converts any other system"
        );
        ("crs".to_owned(), message)
    };
    let name = crs.pointer("/properties/name").and_then(Value::as_str);
    let name = name.ok_or_else(|| unknown("a `crs` without `properties.name`"))?;
    let last = name.rsplit([':', '/']).next().unwrap_or_default();
    if ["crs84", "crs84h"].contains(&last.to_ascii_lowercase().as_str()) {
        return Ok(System::Degrees);
    }
    if last.eq_ignore_ascii_case("engineering") {
        return Ok(System::Metres);
    }
    match last.parse::<u32>() {
        Ok(code) if IN_DEGREES.contains(&code) => Ok(System::Degrees),
        Ok(code) if GRIDS.iter().any(|codes| codes.contains(&code)) => Ok(System::Metres),
        _ => Err(unknown(&format!("the reference system {name:?}"))),
    }
}

/// Tangent plane of the WGS 84 ellipsoid at a point.
struct TangentPlane {
    origin: [f64; 3],
    longitude_rad: f64,
    latitude_rad: f64,
}

impl TangentPlane {
    fn new(longitude_deg: f64, latitude_deg: f64) -> Self {
        Self {
            origin: geocentric_m(longitude_deg, latitude_deg),
            longitude_rad: longitude_deg.to_radians(),
            latitude_rad: latitude_deg.to_radians(),
        }
    }

    /// Returns the metres east and north of the point of tangency.
    fn metres(&self, [longitude_deg, latitude_deg]: [f64; 2]) -> [f64; 2] {
        let [x, y, z] = geocentric_m(longitude_deg, latitude_deg);
        let [dx, dy, dz] = [x - self.origin[0], y - self.origin[1], z - self.origin[2]];
        let (sin_lon, cos_lon) = self.longitude_rad.sin_cos();
        let (sin_lat, cos_lat) = self.latitude_rad.sin_cos();
        let outward = cos_lon * dx + sin_lon * dy;
        [
            cos_lon * dy - sin_lon * dx,
            cos_lat * dz - sin_lat * outward,
        ]
    }
}

/// Returns the geocentric coordinates of a point on the ellipsoid in metres.
fn geocentric_m(longitude_deg: f64, latitude_deg: f64) -> [f64; 3] {
    let (sin_lon, cos_lon) = longitude_deg.to_radians().sin_cos();
    let (sin_lat, cos_lat) = latitude_deg.to_radians().sin_cos();
    let normal_m = SEMI_MAJOR_M / (1.0 - ECCENTRICITY_SQUARED * sin_lat * sin_lat).sqrt();
    [
        normal_m * cos_lat * cos_lon,
        normal_m * cos_lat * sin_lon,
        normal_m * (1.0 - ECCENTRICITY_SQUARED) * sin_lat,
    ]
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
    fn invalid_csv_is_reported_with_its_line() {
        assert_eq!(from_csv("x,y\n1,2\n").unwrap_err().0, "header");
        assert_eq!(from_csv("x_m,y_m\n1,2\n3,nan\n").unwrap_err().0, "line 3");
        let error = from_csv("x_m,y_m\n1,5,2,5\n").unwrap_err();
        assert!(
            error.0 == "line 2" && error.1.contains("semicolons"),
            "{error:?}"
        );
    }

    #[test]
    fn a_german_csv_has_semicolons_and_decimal_commas() {
        let points = from_csv("\u{feff}name;x_m;y_m\r\na;1,5;-2\r\nb;3;4,25\r\n").unwrap();
        assert_eq!(points, vec![[1.5, -2.0], [3.0, 4.25]]);
        let error = from_csv("x_m;y_m\n1,5;2\n1.234;2\n").unwrap_err();
        assert!(error.1.contains("ambiguous"), "{error:?}");
    }

    #[test]
    fn geojson_that_is_not_in_degrees_is_rejected_with_advice() {
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
            let result = line(&format!("[[{place}],[{place}]]"));
            assert!(result.is_ok(), "{result:?}");
        }
    }

    #[test]
    fn geojson_is_converted_to_metres() {
        let text = r#"{"type":"Feature","properties":{},"geometry":
            {"type":"LineString","coordinates":[[8.0,60.0],[8.001,60.0],[8.001,60.001]]}}"#;
        let points = from_geojson(text).unwrap();
        // On the ellipsoid, a degree of longitude at 60° is 55,800 m and a degree of latitude is
        // 111,412 m (NIMA TR8350.2). After 0.001° the tangent plane is 0.4 mm north of the
        // parallel.
        assert!((points[1][0] - 55.800).abs() < 0.002 && points[1][1].abs() < 1e-3);
        assert!((points[2][1] - 111.412).abs() < 0.003);
        let metres = text.replacen(
            "\"type\"",
            r#""crs":{"type":"name","properties":{"name":"EPSG:25832"}},"type""#,
            1,
        );
        assert_eq!(from_geojson(&metres).unwrap()[2], [8.001, 60.001]);
        for (name, expected) in [
            ("urn:ogc:def:crs:EPSG::3857", "access-av file new site"),
            ("EPSG:900913", "access-av file new site"),
            ("EPSG:4978", "access-av file new site"),
            ("unknown", "access-av file new site"),
        ] {
            let other = metres.replace("EPSG:25832", name);
            let (key, message) = from_geojson(&other).unwrap_err();
            assert!(
                key == "crs" && message.contains(expected),
                "{name}: {message}"
            );
        }
        for name in [
            "urn:ogc:def:crs:OGC:1.3:CRS84",
            "EPSG:4269",
            "urn:ogc:def:crs:EPSG::7844",
        ] {
            let other = metres.replace("EPSG:25832", name);
            assert_eq!(from_geojson(&other).unwrap(), points);
        }
        // RFC 7946 has no other system; GeoJSON of 2008 permits null.
        let null = text.replacen("\"type\"", r#""crs":null,"type""#, 1);
        assert_eq!(from_geojson(&null).unwrap(), points);
        let point = r#"{"type":"Point","coordinates":[8,60]}"#;
        assert_eq!(from_geojson(point).unwrap_err().0, "geometry");
    }
}
