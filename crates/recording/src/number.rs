//! Numbers as tables have them, with a decimal point or a decimal comma.

/// Reads the numbers of one table. Where no comma separates its columns, a comma in a number is a
/// decimal one; the first number with a sign says which sign all of them have.
#[derive(Debug)]
pub struct Numbers {
    separator: char,
    sign: Option<char>,
}

impl Numbers {
    /// Of a table whose columns are separated so.
    pub const fn new(separator: char) -> Self {
        Self {
            separator,
            sign: None,
        }
    }

    /// Reads a number.
    ///
    /// # Errors
    /// What is wrong with it, and what to write.
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

    /// What to write where a row has more fields than there are columns.
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
    fn a_comma_is_decimal_where_it_separates_no_columns() {
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
    fn what_may_be_a_thousands_separator_is_refused() {
        for (fields, last) in [(&["3,5"], "1.234"), (&["0.5"], "1,234")] {
            let mut numbers = Numbers::new(';');
            assert!(fields.iter().all(|field| numbers.read(field).is_ok()));
            let told = numbers.read(last).unwrap_err();
            assert!(told.contains("ambiguous"), "{told}");
        }
        for field in ["1.234,5", "1,234,567"] {
            let told = Numbers::new(';').read(field).unwrap_err();
            assert!(told.contains("thousands"), "{told}");
        }
    }
}
