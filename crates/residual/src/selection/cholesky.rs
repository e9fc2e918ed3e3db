//! Cholesky's factor of a system some of whose columns say nothing beside those before them.

use super::fit::dot;

/// Rows that are factored together, and columns that they are worked on at once: a tile's sums fit into the
/// registers, and each number that is read serves several of them.
const TILE: usize = 4;

/// L of a symmetric system, row-major in place; only what is on and below the diagonal is read. The first
/// `kept` rows are those of L already, and `determined` says which of their columns count.
///
/// A column of which less than `least` of its own squared norm is left beside those before it is not
/// determined: its row and column of L are those of the identity.
pub(super) fn factor_rows(
    system: &mut [f64],
    kept: usize,
    determined: &mut [bool],
    least: impl Fn(usize) -> f64,
) {
    pulp::Arch::new().dispatch(Factorisation { system, kept, determined, least });
}

/// A type and no closure, so that all of it is compiled for the widest registers there are.
struct Factorisation<'a, L> {
    system: &'a mut [f64],
    kept: usize,
    determined: &'a mut [bool],
    least: L,
}

impl<L: Fn(usize) -> f64> pulp::NullaryFnOnce for Factorisation<'_, L> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Factorisation { system, kept, determined, least } = self;
        let size = determined.len();
        let mut row = kept;
        while row < size {
            let count = TILE.min(size - row);
            let (before, rest) = system.split_at_mut(row * size);
            let panel = &mut rest[..count * size];
            let tiled = if count == TILE { row - row % TILE } else { 0 };
            for column in (0..tiled).step_by(TILE) {
                tile(before, panel, size, column, determined);
            }
            for place in 0..count {
                let (above, own) = panel.split_at_mut(place * size);
                let own = &mut own[..size];
                let own_row = row + place;
                for column in tiled..own_row {
                    let other = match column.checked_sub(row) {
                        Some(within) => &above[within * size..within * size + column + 1],
                        None => &before[column * size..column * size + column + 1],
                    };
                    own[column] = match determined[column] {
                        true => (own[column] - dot(&own[..column], &other[..column])) / other[column],
                        false => 0.0,
                    };
                }
                let norm = own[own_row];
                let left = norm - dot(&own[..own_row], &own[..own_row]);
                determined[own_row] = left > least(own_row) * norm && left > 0.0;
                if determined[own_row] {
                    own[own_row] = left.sqrt();
                } else {
                    own[..own_row].fill(0.0);
                    own[own_row] = 1.0;
                }
            }
            row += count;
        }
    }
}

/// y = L⁻¹·x, where the columns that are not determined are left at nothing.
pub(super) fn substitute(triangle: &[f64], determined: &[bool], x: &[f64], y: &mut [f64]) {
    pulp::Arch::new().dispatch(Substitution { triangle, determined, x, y });
}

struct Substitution<'a> {
    triangle: &'a [f64],
    determined: &'a [bool],
    x: &'a [f64],
    y: &'a mut [f64],
}

impl pulp::NullaryFnOnce for Substitution<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Substitution { triangle, determined, x, y } = self;
        let size = determined.len();
        let first = x.iter().take(size).take_while(|x| **x == 0.0).count();
        for row in first..size {
            if determined[row] {
                let own = &triangle[row * size..row * size + row + 1];
                y[row] = (x[row] - dot(&own[first..row], &y[first..row])) / own[row];
            }
        }
    }
}

/// Right-hand sides that are worked on together.
pub(super) const TOGETHER: usize = 8;

/// [`substitute`] for several right-hand sides: `sides` has those of one row beside each other, and becomes
/// the solutions. Numbers of the triangle that are read serve all of them.
pub(super) fn substitute_together(triangle: &[f64], determined: &[bool], sides: &mut [[f64; TOGETHER]]) {
    pulp::Arch::new().dispatch(Together { triangle, determined, sides });
}

struct Together<'a> {
    triangle: &'a [f64],
    determined: &'a [bool],
    sides: &'a mut [[f64; TOGETHER]],
}

impl pulp::NullaryFnOnce for Together<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Together { triangle, determined, sides } = self;
        let size = determined.len();
        let first = sides.iter().take(size).take_while(|side| **side == [0.0; TOGETHER]).count();
        let mut row = first;
        while row < size {
            let count = TILE.min(size - row);
            let (known, rest) = sides.split_at_mut(row);
            // Rows beyond the last repeat it: a tile's sums fit into the registers.
            let own: [&[f64]; TILE] = std::array::from_fn(|place| {
                let row = (row + place).min(size - 1);
                &triangle[row * size..row * size + row + 1]
            });
            let sums = products(&known[first..], own.map(|own| &own[first..row]));
            for place in 0..count {
                let (before, left) = rest.split_at_mut(place);
                let (own, left) = (&own[place][row..], &mut left[0]);
                if !determined[row + place] {
                    *left = [0.0; TOGETHER];
                    continue;
                }
                for lane in 0..TOGETHER {
                    let within: f64 = before.iter().zip(own).map(|(before, own)| own * before[lane]).sum();
                    left[lane] = (left[lane] - sums[place][lane] - within) / own[place];
                }
            }
            row += count;
        }
    }
}

/// For each of a tile's rows its product with what is known of every right-hand side.
#[inline(always)]
fn products(known: &[[f64; TOGETHER]], rows: [&[f64]; TILE]) -> [[f64; TOGETHER]; TILE] {
    let [a, b, c, d] = rows.map(|row| &row[..known.len()]);
    let [mut of_a, mut of_b, mut of_c, mut of_d] = [[0.0; TOGETHER]; TILE];
    for (at, known) in known.iter().enumerate() {
        for lane in 0..TOGETHER {
            of_a[lane] += a[at] * known[lane];
            of_b[lane] += b[at] * known[lane];
            of_c[lane] += c[at] * known[lane];
            of_d[lane] += d[at] * known[lane];
        }
    }
    [of_a, of_b, of_c, of_d]
}

/// Columns `first` to `first + TILE` of a panel of rows, all columns before them being done.
#[inline(always)]
fn tile(before: &[f64], panel: &mut [f64], size: usize, first: usize, determined: &[bool]) {
    let others: [&[f64]; TILE] = std::array::from_fn(|column| {
        &before[(first + column) * size..(first + column) * size + first + TILE]
    });
    let mut known = [[0.0; TILE]; TILE];
    // Half of the columns at once: the sums of all would not fit into the registers.
    for half in [0, TILE / 2] {
        let mut sums = [[[0.0; TILE]; TILE / 2]; TILE];
        for at in (0..first).step_by(TILE) {
            for (row, sums) in sums.iter_mut().enumerate() {
                let own = &panel[row * size + at..row * size + at + TILE];
                for (column, sums) in sums.iter_mut().enumerate() {
                    let other = &others[half + column][at..at + TILE];
                    (0..TILE).for_each(|lane| sums[lane] += own[lane] * other[lane]);
                }
            }
        }
        for row in 0..TILE {
            for column in 0..TILE / 2 {
                let [a, b, c, d] = sums[row][column];
                known[row][half + column] = (a + b) + (c + d);
            }
        }
    }
    for (row, known) in known.iter().enumerate() {
        let own = &mut panel[row * size + first..row * size + first + TILE];
        for column in 0..TILE {
            let other = &others[column][first..];
            let within: f64 = (0..column).map(|k| own[k] * other[k]).sum();
            own[column] = match determined[first + column] {
                true => (own[column] - known[column] - within) / other[column],
                false => 0.0,
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A triangle with some columns that say nothing, and right-hand sides that begin with zeros.
    #[test]
    fn solutions_that_are_found_together_are_those_that_are_found_alone() {
        for size in [1, 3, 4, 7, 8, 21] {
            let number = |row: usize, column: usize| ((row * 37 + column * 11) as f64).sin();
            let determined: Vec<bool> = (0..size).map(|row| row % 5 != 3).collect();
            let mut triangle = vec![0.0; size * size];
            for row in 0..size {
                for column in (0..row).filter(|&column| determined[row] && determined[column]) {
                    triangle[row * size + column] = number(row, column);
                }
                triangle[row * size + row] = if determined[row] { 2.0 + number(row, row) } else { 1.0 };
            }
            for zeros in [0, 1, 5].into_iter().filter(|&zeros| zeros < size) {
                let side = |row: usize, lane: usize| {
                    if row < zeros + lane { 0.0 } else { number(row, 100 + lane) }
                };
                let mut together: Vec<[f64; TOGETHER]> =
                    (0..size).map(|row| std::array::from_fn(|lane| side(row, lane))).collect();
                substitute_together(&triangle, &determined, &mut together);
                for lane in 0..TOGETHER {
                    let x: Vec<f64> = (0..size).map(|row| side(row, lane)).collect();
                    let mut alone = vec![0.0; size];
                    substitute(&triangle, &determined, &x, &mut alone);
                    for (together, alone) in together.iter().zip(&alone) {
                        assert!(
                            (together[lane] - alone).abs() <= 1e-12 * (1.0 + alone.abs()),
                            "{size} {zeros}"
                        );
                    }
                }
            }
        }
    }

    /// LLᵀ of the rows that count.
    fn product(l: &[f64], size: usize, determined: &[bool]) -> Vec<f64> {
        let entry = |row: usize, k: usize| if determined[k] && k <= row { l[row * size + k] } else { 0.0 };
        (0..size * size)
            .map(|at| (0..size).map(|k| entry(at / size, k) * entry(at % size, k)).sum())
            .collect()
    }

    proptest! {
        #[test]
        fn the_factors_square_is_the_system_whatever_was_kept(
            size in 1_usize..23, kept in 0_usize..23, copies in prop::collection::vec(0_usize..23, 0..4), seed in 0_u64..1000,
        ) {
            let kept = kept.min(size);
            // Columns of pseudo-random numbers; some are copies of earlier ones and say nothing beside them.
            let number = |row: usize, column: usize| {
                let mixed = (seed + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ ((row * 131 + column) as u64 + 7).wrapping_mul(0xbf58_476d_1ce4_e5b9);
                (mixed ^ (mixed >> 29)) as u32 as f64 / f64::from(u32::MAX) - 0.5
            };
            let source = |column: usize| {
                if copies.contains(&column) && column > 0 { column / 2 } else { column }
            };
            let rows = 40;
            let mut system = vec![0.0; size * size];
            for a in 0..size {
                for b in 0..=a {
                    system[a * size + b] = (0..rows).map(|row| number(row, source(a)) * number(row, source(b))).sum();
                }
            }
            let mut whole = system.clone();
            let mut determined = vec![true; size];
            factor_rows(&mut whole, 0, &mut determined, |_| 1e-8);
            let square = product(&whole, size, &determined);
            for a in 0..size {
                for b in 0..=a {
                    if determined[a] && determined[b] {
                        prop_assert!((square[a * size + b] - system[a * size + b]).abs() < 1e-9);
                    }
                }
                let first_of_its_kind = (0..a).all(|b| source(b) != source(a));
                prop_assert_eq!(determined[a], first_of_its_kind);
            }
            let mut continued = system.clone();
            continued[..kept * size].copy_from_slice(&whole[..kept * size]);
            let mut again = determined.clone();
            again[kept..].fill(true);
            factor_rows(&mut continued, kept, &mut again, |_| 1e-8);
            prop_assert_eq!(&again, &determined);
            for row in 0..size {
                for column in 0..=row {
                    prop_assert!((continued[row * size + column] - whole[row * size + column]).abs() < 1e-7);
                }
            }
        }
    }
}
