//! Counts the rows of a log: `cargo run -p phiw-log-formats --example rows -- LOG`.

use phiw_log_formats::{OpenOptions, Step, open};
use std::path::Path;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let log = std::env::args().nth(1).ok_or("name a log")?;
    let mut table = open(Path::new(&log), &OpenOptions::default())?;
    table.select(&(0..table.columns().len()).collect::<Vec<_>>())?;
    let mut row = vec![0.0; table.columns().len()];
    let mut rows = 0_u64;
    while let Step::Row { .. } = table.next(&mut row)? {
        rows += 1;
    }
    println!("{rows} rows of {} columns", row.len());
    Ok(())
}
