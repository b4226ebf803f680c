//! Roads from survey files: CSV and GeoJSON.

use std::path::Path;

use onboard::settings::SettingsError;
use serde_json::Value;

use crate::text::read_text;

/// A road of a million points.
const MOST_BYTES: u64 = 64 << 20;

/// Mean radius of the Earth in metres (IUGG); a road is short enough for a sphere.
const EARTH_RADIUS_M: f64 = 6_371_008.8;

/// Reads the points of a road: the columns `x_m` and `y_m` of a CSV file, or a GeoJSON `LineString`
/// projected onto the tangent plane of its first point.
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
    let mut lines = text
        .lines()
        .enumerate()
        .filter(|(_, line)| !line.trim().is_empty());
    let header = lines.next().map(|(_, line)| line).unwrap_or_default();
    let column = |name: &str| {
        header
            .split(',')
            .position(|cell| cell.trim() == name)
            .ok_or_else(|| {
                (
                    "header".to_owned(),
                    format!("the columns `x_m` and `y_m` are needed, found `{header}`"),
                )
            })
    };
    let (x, y) = (column("x_m")?, column("y_m")?);
    lines
        .map(|(index, line)| {
            let cells: Vec<&str> = line.split(',').map(str::trim).collect();
            let number = |column: usize, name: &str| {
                let cell = cells.get(column).copied().unwrap_or_default();
                cell.parse::<f64>()
                    .ok()
                    .filter(|number| number.is_finite())
                    .ok_or_else(|| {
                        (
                            format!("line {}", index + 1),
                            format!("`{name}` must be a finite number, found `{cell}`"),
                        )
                    })
            };
            Ok([number(x, "x_m")?, number(y, "y_m")?])
        })
        .collect()
}

/// The first `LineString`, from longitude and latitude to metres east and north of its first point.
fn from_geojson(text: &str) -> Result<Vec<[f64; 2]>, Defect> {
    let defect = |key: &str, message: &str| (key.to_owned(), message.to_owned());
    let json: Value = serde_json::from_str(text).map_err(|e| defect("JSON", &e.to_string()))?;
    let line = line_string(&json)
        .ok_or_else(|| defect("geometry", "a geometry of type `LineString` is needed"))?;
    let mut degrees = Vec::with_capacity(line.len());
    for (index, place) in line.iter().enumerate() {
        let number = |axis: usize, limit: f64| {
            place
                .get(axis)
                .and_then(Value::as_f64)
                .filter(|degrees| degrees.abs() <= limit)
        };
        let (Some(longitude), Some(latitude)) = (number(0, 180.0), number(1, 90.0)) else {
            return Err((
                format!("coordinates[{index}]"),
                "it must be [longitude, latitude] in degrees".to_owned(),
            ));
        };
        degrees.push([longitude, latitude]);
    }
    let Some(&[longitude_0, latitude_0]) = degrees.first() else {
        return Err(defect("coordinates", "at least two points are needed"));
    };
    let metres_per_degree = EARTH_RADIUS_M.to_radians();
    let shrink = latitude_0.to_radians().cos();
    Ok(degrees
        .iter()
        .map(|[longitude, latitude]| {
            let east_m = (longitude - longitude_0) * metres_per_degree * shrink;
            [east_m, (latitude - latitude_0) * metres_per_degree]
        })
        .collect())
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
    }

    #[test]
    fn geojson_becomes_metres() {
        let text = r#"{"type":"Feature","properties":{},"geometry":
            {"type":"LineString","coordinates":[[8.0,60.0],[8.001,60.0],[8.001,60.001]]}}"#;
        let points = from_geojson(text).unwrap();
        assert!((points[1][0] - 55.597).abs() < 0.01 && points[1][1].abs() < 1e-9);
        assert!((points[2][1] - 111.195).abs() < 0.01);
        let point = r#"{"type":"Point","coordinates":[8,60]}"#;
        assert_eq!(from_geojson(point).unwrap_err().0, "geometry");
    }
}
