//! Tables for Python: dictionaries of columns.

use numpy::{Element, PyArray1};
use onboard::localize::Integrity;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

/// Dictionary of columns with one value for each row.
pub struct Table<'py, R> {
    columns: Bound<'py, PyDict>,
    rows: R,
}

impl<'py, R: Iterator + Clone> Table<'py, R> {
    /// Creates a table without columns.
    pub fn new(py: Python<'py>, rows: R) -> Self {
        let columns = PyDict::new(py);
        Self { columns, rows }
    }

    /// Adds a column as a NumPy array.
    ///
    /// # Errors
    /// Errors of Python, such as a lack of memory.
    pub fn column<T: Element>(self, name: &str, value: impl Fn(R::Item) -> T) -> PyResult<Self> {
        let values = self.rows.clone().map(value).collect();
        let values = PyArray1::from_vec(self.columns.py(), values);
        self.columns.set_item(name, values)?;
        Ok(self)
    }

    /// Adds a column as a list, for texts and missing values.
    ///
    /// # Errors
    /// Errors of [`column`](Self::column).
    pub fn list<T: IntoPyObject<'py>>(
        self,
        name: &str,
        value: impl Fn(R::Item) -> T,
    ) -> PyResult<Self> {
        let values: Vec<T> = self.rows.clone().map(value).collect();
        let values = PyList::new(self.columns.py(), values)?;
        self.columns.set_item(name, values)?;
        Ok(self)
    }

    /// Returns the dictionary.
    pub fn finish(self) -> Py<PyDict> {
        self.columns.unbind()
    }
}

/// Returns a protection level in metres; NaN without one.
pub fn level(of: Option<Integrity>, which: fn(&Integrity) -> f64) -> f64 {
    of.as_ref().map_or(f64::NAN, which)
}

/// Returns an element of the covariance of x, y and heading, in metres and radians; NaN without one.
pub fn covariance(of: Option<[[f64; 3]; 3]>, row: usize, column: usize) -> f64 {
    let element = of.and_then(|it| it.get(row)?.get(column).copied());
    element.unwrap_or(f64::NAN)
}
