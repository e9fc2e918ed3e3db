//! A log as cells of text.

/// A CSV file as text.
#[derive(Clone, Debug)]
pub struct Table {
    /// The columns' names.
    pub header: Vec<String>,
    /// The cells, row by row.
    pub rows: Vec<Vec<String>>,
}

impl Table {
    /// The cells of `text`, which has no quotes.
    pub fn parse(text: &str) -> Self {
        let mut lines = text.lines().map(|line| line.split(',').map(str::to_owned).collect::<Vec<_>>());
        Table { header: lines.next().unwrap_or_default(), rows: lines.collect() }
    }

    /// The file.
    pub fn text(&self) -> String {
        let mut text = self.header.join(",");
        text.push('\n');
        for row in &self.rows {
            text += &row.join(",");
            text.push('\n');
        }
        text
    }

    /// Columns whose name begins with `prefix`, such as `q.`.
    pub fn columns(&self, prefix: &str) -> Vec<usize> {
        let starts = |name: &String| name.starts_with(prefix);
        (0..self.header.len()).filter(|&column| starts(&self.header[column])).collect()
    }

    /// The number in a cell; NaN where there is none.
    pub fn number(&self, row: usize, column: usize) -> f64 {
        self.rows[row][column].parse().unwrap_or(f64::NAN)
    }

    /// Replaces every number of a column by `change(row, number)`.
    pub fn map(&mut self, column: usize, change: impl Fn(usize, f64) -> f64) {
        for row in 0..self.rows.len() {
            self.rows[row][column] = change(row, self.number(row, column)).to_string();
        }
    }

    /// A new column at the end.
    pub fn push_column(&mut self, name: &str, number: impl Fn(usize) -> f64) {
        self.header.push(name.to_owned());
        for (index, row) in self.rows.iter_mut().enumerate() {
            row.push(number(index).to_string());
        }
    }
}
