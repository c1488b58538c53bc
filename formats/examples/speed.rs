use formats::textrace::*;
fn cpu() -> f64 {
    let s = std::fs::read_to_string("/proc/self/schedstat").unwrap();
    s.split_whitespace().next().unwrap().parse::<f64>().unwrap() / 1e9
}
fn main() {
    let mut args = std::env::args().skip(1);
    let src = Textrace::open(args.next().unwrap().as_ref()).unwrap();
    let rounds: usize = args.next().map_or(6, |a| a.parse().unwrap());
    let t = src.tables().clone();
    let n: Vec<usize> = t.passes.iter().map(|p| p.tile_count() as usize).collect();
    let encs = [Encoding::Delta, Encoding::Planes];
    let mut traces = vec![];
    for e in encs {
        let c = cpu();
        let mut w = TextraceWriter::in_memory(&t).unwrap();
        let mut tile = Tile::default();
        let mut d = 0.;
        for (p, n) in n.iter().enumerate() {
            for i in 0..*n {
                let c2 = cpu();
                src.decode_tile(p, i, &mut tile).unwrap();
                d += cpu() - c2;
                w.append(p, i, encode_tile_as(e, &t, &tile).unwrap())
                    .unwrap();
            }
        }
        let b = w.into_bytes().unwrap();
        println!("{e:?} encode {:.2}s", cpu() - c - d);
        traces.push(Textrace::from_bytes(b).unwrap());
    }
    let mut recs = 0u64;
    let mut bytes = [0u64; 2];
    for (p, n) in n.iter().enumerate() {
        for i in 0..*n {
            recs += src.tile_stats(p, i).records as u64;
            for k in 0..2 {
                bytes[k] += traces[k].tile_stats(p, i).bytes as u64
            }
        }
    }
    let mut best = [1e9f64; 2];
    let mut sum = [0f64; 2];
    for _ in 0..rounds {
        for k in 0..2 {
            let c = cpu();
            let mut tile = Tile::default();
            for (p, n) in n.iter().enumerate() {
                for i in 0..*n {
                    traces[k].decode_tile(p, i, &mut tile).unwrap();
                    std::hint::black_box(&tile);
                }
            }
            let d = cpu() - c;
            best[k] = best[k].min(d);
            sum[k] += d;
        }
    }
    for k in 0..2 {
        println!(
            "{:?}: {:.3} B/quad, best {:.1} ns/quad, mean {:.1}",
            encs[k],
            bytes[k] as f64 / recs as f64,
            best[k] / recs as f64 * 1e9,
            sum[k] / rounds as f64 / recs as f64 * 1e9
        )
    }
}
