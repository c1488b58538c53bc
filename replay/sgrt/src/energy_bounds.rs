//! Bounds of relative energies: the default energies are 45 nm figures, and the paper's chip is 14 nm.
//!
//! Each component of the energy may be scaled by any factor of its range, independently of the others. A ratio
//! of two sums is monotonic in each factor, so its extremes are at the corners of the ranges.

use super::run::EnergyPj;

/// A component of the energy and the range of its factor.
type Component = (fn(&EnergyPj) -> f64, [f64; 2]);

/// Components with the range of factors from the default energies to a 14 nm chip with LPDDR4.
///
/// 14 nm lies between 45 nm and 7 nm, for which Jouppi et al. (Ten Lessons From Three Generations Shaped
/// Google's TPUv4i, ISCA 2021, table 2) give 3.7 and 1.31 pJ per 32-bit multiplication, and 10 and 7.5 pJ per
/// 64-bit access of an 8 KB SRAM. For DRAM they give 350 pJ per 64 bits of GDDR6 as the least of
/// memories without stacking; 2.6 nJ is the upper figure for 45 nm systems. Static power is a guess: none to four times the default.
const COMPONENTS: [Component; 6] = [
    (|e| e.tni_pj, LOGIC),
    (|e| e.srp_pj, LOGIC),
    (|e| e.caches_pj, SRAM),
    (|e| e.sram_pj, SRAM),
    (|e| e.dram_pj, [0.27, 2.0]),
    (|e| e.static_pj, [0.0, 4.0]),
];
const LOGIC: [f64; 2] = [0.35, 1.0];
const SRAM: [f64; 2] = [0.75, 1.0];

/// Least and most energy of a run relative to a reference, over all factors within their ranges.
pub(super) fn relative_bounds(run: &EnergyPj, reference: &EnergyPj) -> [f64; 2] {
    let ratios = (0..1_u32 << COMPONENTS.len()).map(|corner| {
        let factor = |number: usize, range: [f64; 2]| range[(corner >> number & 1) as usize];
        let total = |of: &EnergyPj| {
            let scaled = COMPONENTS.iter().enumerate();
            scaled
                .map(|(number, (part, range))| part(of) * factor(number, *range))
                .sum::<f64>()
        };
        total(run) / total(reference)
    });
    ratios.fold(
        [f64::INFINITY, f64::NEG_INFINITY],
        |[least, most], ratio| [least.min(ratio), most.max(ratio)],
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn energy() -> impl Strategy<Value = EnergyPj> {
        prop::array::uniform6(1.0..1e6).prop_map(|[a, b, c, d, e, f]| EnergyPj {
            tni_pj: a,
            srp_pj: b,
            caches_pj: c,
            sram_pj: d,
            dram_pj: e,
            static_pj: f,
        })
    }

    proptest! {
        #[test]
        fn no_factors_within_the_ranges_exceed_the_bounds(
            run in energy(), reference in energy(), at in prop::array::uniform6(0.0..=1.0),
        ) {
            let [least, most] = relative_bounds(&run, &reference);
            let total = |of: &EnergyPj| -> f64 {
                let scaled = COMPONENTS.iter().zip(at);
                scaled.map(|((part, [low, high]), at)| part(of) * (low + (high - low) * at)).sum()
            };
            let ratio = total(&run) / total(&reference);
            prop_assert!(least * (1.0 - 1e-12) <= ratio && ratio <= most * (1.0 + 1e-12));
            prop_assert!(least <= run.total() / reference.total());
            prop_assert!(run.total() / reference.total() <= most);
        }
    }

    #[test]
    fn the_bounds_are_reached_where_one_component_changes() {
        let of = |dram_pj| EnergyPj {
            tni_pj: 100.0,
            dram_pj,
            ..EnergyPj::default()
        };
        let [least, most] = relative_bounds(&of(50.0), &of(100.0));
        // Most of DRAM and least of logic, and the other way round.
        assert!((least - (35.0 + 100.0) / (35.0 + 200.0)).abs() < 1e-12);
        assert!((most - (100.0 + 13.5) / (100.0 + 27.0)).abs() < 1e-12);
    }
}
