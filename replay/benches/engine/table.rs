//! Prints the rows as a table.

/// A stage.
pub struct Row {
    /// Name of the stage, with its unit if not lines.
    pub name: String,
    /// Number of items processed.
    pub items: u64,
    /// Bytes read or written.
    pub bytes: u64,
    /// Time of the shortest run.
    pub seconds: f64,
    /// Whether it is the plain LRU.
    pub yardstick: bool,
}

impl Row {
    /// A row that is not the yardstick.
    pub fn new(name: impl Into<String>, items: u64, bytes: u64, seconds: f64) -> Self {
        Self {
            name: name.into(),
            items,
            bytes,
            seconds,
            yardstick: false,
        }
    }

    fn items_per_second(&self) -> f64 {
        self.items as f64 / self.seconds
    }
}

/// Prints the rows; `bandwidth` is in bytes per second.
pub fn print(bandwidth: f64, rows: &[Row]) {
    println!("memory is read at {:.1} GB/s\n", bandwidth / 1e9);
    println!("| stage | items, M | ms | M items/s | GB/s | of the bandwidth | plain LRU = 1 |");
    println!("| --- | --- | --- | --- | --- | --- | --- |");
    let plain = rows.iter().find(|row| row.yardstick);
    let plain = plain.map_or(f64::NAN, Row::items_per_second);
    for row in rows {
        let rate = row.bytes as f64 / row.seconds;
        println!(
            "| {} | {:.2} | {:.1} | {:.0} | {:.2} | {:.0} % | {:.2} |",
            row.name,
            row.items as f64 / 1e6,
            row.seconds * 1e3,
            row.items_per_second() / 1e6,
            rate / 1e9,
            100.0 * rate / bandwidth,
            row.items_per_second() / plain,
        );
    }
}
