//! Prints the quads and fragments that each pass of a texture trace records.

use formats::{Textrace, textrace::Tile};
use std::path::Path;

/// Quad records and covered fragments of each pass.
pub fn counts(path: &Path) -> formats::Result<Vec<[u64; 2]>> {
    let trace = Textrace::open(path)?;
    let mut tile = Tile::default();
    let mut counts = Vec::new();
    for (pass, info) in trace.tables().passes.iter().enumerate() {
        let mut of_pass = [0; 2];
        for index in 0..info.tile_count() as usize {
            trace.decode_tile(pass, index, &mut tile)?;
            for record in &tile.records {
                of_pass[0] += 1;
                of_pass[1] += u64::from(record.mask.count_ones());
            }
        }
        counts.push(of_pass);
    }
    Ok(counts)
}

#[allow(dead_code, reason = "a test runs the function above")]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).ok_or("expected FILE.textrace")?;
    for (pass, [quads, fragments]) in counts(Path::new(&path))?.iter().enumerate() {
        println!("pass {pass}: {quads} quad records, {fragments} fragments");
    }
    Ok(())
}
