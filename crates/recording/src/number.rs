//! Numbers of tables with a decimal point or a decimal comma.

/// Reader of the numbers of one table. A comma in a number is a decimal comma unless commas
/// separate the columns. The first number with a decimal sign determines the sign of all numbers.
#[derive(Debug)]
pub struct Numbers {
    separator: char,
    sign: Option<char>,
}

impl Numbers {
    /// Creates a reader for a table with this column separator.
    pub const fn new(separator: char) -> Self {
        Self {
            separator,
            sign: None,
        }
    }

    /// Reads a number.
    ///
    /// # Errors
    /// Description of the error and of the correct notation.
    pub fn read(&mut self, field: &str) -> Result<f64, String> {
        let not_a_number = || format!("`{field}` is not a number");
        let signs: Vec<char> = field.chars().filter(|it| ".,".contains(*it)).collect();
        let sign = match *signs.as_slice() {
            [] => return field.parse().map_err(|_| not_a_number()),
            [sign] => sign,
            _ => {
                return Err(format!(
                    "`{field}` is ambiguous: write no thousands separators, and one decimal point \
                     or comma"
                ));
            }
        };
        if sign == ',' && self.separator == ',' {
            return Err(not_a_number());
        }
        let number = field
            .replace(',', ".")
            .parse()
            .map_err(|_| not_a_number())?;
        if *self.sign.get_or_insert(sign) == sign {
            Ok(number)
        } else {
            Err(format!(
                "`{field}` is ambiguous: numbers before it have the other decimal sign; write all of \
                 them with a point, or all with a comma"
            ))
        }
    }

    /// Returns the advice for a row with more fields than columns.
    pub const fn surplus_hint(&self) -> &'static str {
        if self.separator == ',' {
            "; with decimal commas, separate the columns by semicolons"
        } else {
            ""
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_comma_is_decimal_unless_it_separates_columns() {
        let mut numbers = Numbers::new(';');
        for (field, number) in [
            ("3,5", 3.5),
            ("-0,25", -0.25),
            ("1,5e-3", 1.5e-3),
            ("7", 7.0),
        ] {
            assert_eq!(numbers.read(field), Ok(number));
        }
        assert_eq!(Numbers::new('\t').read("3.5"), Ok(3.5));
        assert!(Numbers::new(',').read("3,5").is_err());
    }

    #[test]
    fn possible_thousands_separators_are_rejected() {
        for (fields, last) in [(&["3,5"], "1.234"), (&["0.5"], "1,234")] {
            let mut numbers = Numbers::new(';');
            assert!(fields.iter().all(|field| numbers.read(field).is_ok()));
            let message = numbers.read(last).unwrap_err();
            assert!(message.contains("ambiguous"), "{message}");
        }
        for field in ["1.234,5", "1,234,567"] {
            let message = Numbers::new(';').read(field).unwrap_err();
            assert!(message.contains("thousands"), "{message}");
        }
    }
}
