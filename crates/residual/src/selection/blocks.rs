//! Cholesky's factor of a system in blocks.
//!
//! Limbs that stand on a base which does not move have no parameter of their bodies in common, nor have the
//! effects on their joints: a quadruped has four systems of a quarter of the size, and each is solved by
//! itself. The few effects that act on several limbs, a coupling of two legs or a tilt of the base, come
//! after all blocks.

use super::cholesky::{TOGETHER, factor_rows, substitute, substitute_together};
use super::fit::dot;

/// A symmetric system, then L of its Cholesky factor; only what is on and below the diagonal counts.
#[derive(Clone, Debug, Default)]
pub(super) struct Blocks {
    /// Where each place of the whole system is.
    at: Vec<At>,
    blocks: Vec<Block>,
    /// Places that act on several limbs, in their order.
    links: Vec<Link>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum At {
    Block { block: usize, row: usize },
    Link(usize),
}

#[derive(Clone, Debug)]
struct Block {
    /// Places of its rows in the whole system, ascending.
    places: Vec<usize>,
    /// Row-major.
    values: Vec<f64>,
    /// Whether a row is determined beside those before it.
    determined: Vec<bool>,
}

/// A row that comes after all blocks.
#[derive(Clone, Debug)]
struct Link {
    place: usize,
    /// Elements at the places of all blocks and of the links before it; nothing at others.
    row: Vec<f64>,
    diagonal: f64,
    determined: bool,
}

impl Block {
    fn row(&self, row: usize) -> &[f64] {
        let size = self.places.len();
        &self.values[row * size..row * size + row + 1]
    }

    /// What a vector over the whole system has at its places.
    fn part<'a>(&'a self, whole: &'a [f64]) -> impl Iterator<Item = f64> + 'a {
        self.places.iter().map(|&place| whole[place])
    }

    fn is_zero(&self, whole: &[f64]) -> bool {
        self.part(whole).all(|value| value == 0.0)
    }

    /// L⁻¹·x of its places, for a vector over the whole system.
    fn forward(&self, x: &[f64], y: &mut [f64]) {
        let part: Vec<f64> = self.part(x).collect();
        let mut solved = vec![0.0; part.len()];
        substitute(&self.values, &self.determined, &part, &mut solved);
        self.places.iter().zip(solved).for_each(|(&place, value)| y[place] = value);
    }

    fn backward(&self, y: &mut [f64]) {
        let mut part: Vec<f64> = self.part(y).collect();
        for row in (0..part.len()).rev() {
            if !self.determined[row] {
                part[row] = 0.0;
                continue;
            }
            let own = self.row(row);
            part[row] /= own[row];
            let value = part[row];
            part[..row].iter_mut().zip(own).for_each(|(y, entry)| *y -= entry * value);
        }
        self.places.iter().zip(part).for_each(|(&place, value)| y[place] = value);
    }
}

/// The torque that stands for the limb of `torque`: the last that `of` leads to, which leads to itself.
fn limb(of: &[usize], mut torque: usize) -> usize {
    while of[torque] != torque {
        torque = of[torque];
    }
    torque
}

impl Blocks {
    /// Zeros for a system of `size` places, `of_torques` of which act on each torque. The first `model`
    /// places say which torques are of one limb.
    pub fn of_zeros(size: usize, model: usize, of_torques: &[Vec<usize>]) -> Self {
        let mut limbs: Vec<usize> = (0..of_torques.len()).collect();
        let mut torque_of: Vec<Option<usize>> = vec![None; size];
        for (torque, places) in of_torques.iter().enumerate() {
            for &place in places.iter().filter(|place| **place < model) {
                let first = limb(&limbs, *torque_of[place].get_or_insert(torque));
                let other = limb(&limbs, torque);
                limbs[first.max(other)] = first.min(other);
            }
        }
        let mut is_link = vec![false; size];
        for (torque, places) in of_torques.iter().enumerate() {
            for &place in places.iter().filter(|place| **place >= model) {
                let first = *torque_of[place].get_or_insert(torque);
                is_link[place] |= limb(&limbs, first) != limb(&limbs, torque);
            }
        }
        // What acts on no torque is in the last block.
        let mut of_blocks: Vec<Vec<usize>> = vec![Vec::new(); of_torques.len() + 1];
        let mut blocks = Blocks::default();
        for place in 0..size {
            if is_link[place] {
                blocks.links.push(Link { place, row: vec![0.0; size], diagonal: 0.0, determined: true });
            } else {
                of_blocks[torque_of[place].map_or(of_torques.len(), |torque| limb(&limbs, torque))]
                    .push(place);
            }
        }
        blocks.at = vec![At::Link(0); size];
        for (link, own) in blocks.links.iter().enumerate() {
            blocks.at[own.place] = At::Link(link);
        }
        for places in of_blocks.into_iter().filter(|places| !places.is_empty()) {
            for (row, &place) in places.iter().enumerate() {
                blocks.at[place] = At::Block { block: blocks.blocks.len(), row };
            }
            let (values, determined) = (vec![0.0; places.len() * places.len()], vec![true; places.len()]);
            blocks.blocks.push(Block { places, values, determined });
        }
        blocks
    }

    /// Takes the first `kept` rows of a factor that begins with the same places; links are made anew.
    pub fn keep(&mut self, start: &Blocks, kept: usize) {
        for place in 0..kept {
            let (At::Block { block, row }, At::Block { block: from, row: from_row }) =
                (self.at[place], start.at[place])
            else {
                continue;
            };
            let (own, from) = (&mut self.blocks[block], &start.blocks[from]);
            own.determined[row] = from.determined[from_row];
            let size = own.places.len();
            own.values[row * size..row * size + row + 1].copy_from_slice(from.row(from_row));
        }
    }

    /// Whether a place acts on several limbs.
    pub fn is_link(&self, place: usize) -> bool {
        matches!(self.at[place], At::Link(_))
    }

    /// Adds to an element: of a block on or below its diagonal, or of a link and any place but a later link.
    /// Places of two blocks have no product.
    #[inline(always)]
    pub fn add(&mut self, row: usize, column: usize, value: f64) {
        match (self.at[row], self.at[column]) {
            (At::Block { block, row }, At::Block { block: of_column, row: column }) if block == of_column => {
                let block = &mut self.blocks[block];
                block.values[row * block.places.len() + column] += value;
            }
            (At::Link(link), _) if row == column => self.links[link].diagonal += value,
            (At::Link(link), _) => self.links[link].row[column] += value,
            (At::Block { .. }, _) => (),
        }
    }

    /// The system's factor, of which the first `kept` places are there already, but for links. `determined`
    /// becomes whether of a place more than `least` of its squared norm is left beside those before it.
    pub fn factor(&mut self, kept: usize, determined: &mut [bool], least: impl Fn(usize) -> f64) {
        for block in &mut self.blocks {
            let Block { places, values, determined: own } = block;
            let kept = places.partition_point(|&place| place < kept);
            factor_rows(values, kept, own, |row| least(places[row]));
            places.iter().zip(own).for_each(|(&place, own)| determined[place] = *own);
        }
        for index in 0..self.links.len() {
            let (before, own) = self.links.split_at_mut(index);
            let own = &mut own[0];
            let products = std::mem::replace(&mut own.row, vec![0.0; self.at.len()]);
            self.blocks.iter().for_each(|block| block.forward(&products, &mut own.row));
            for other in before.iter().filter(|other| other.determined) {
                own.row[other.place] = (products[other.place] - dot(&own.row, &other.row)) / other.diagonal;
            }
            let left = own.diagonal - dot(&own.row, &own.row);
            own.determined = left > least(own.place) * own.diagonal && left > 0.0;
            if own.determined {
                own.diagonal = left.sqrt();
            } else {
                own.row.fill(0.0);
                own.diagonal = 1.0;
            }
            determined[own.place] = own.determined;
        }
    }

    /// L⁻¹·x.
    pub fn forward(&self, x: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; x.len()];
        if let ([only], []) = (self.blocks.as_slice(), self.links.as_slice()) {
            substitute(&only.values, &only.determined, x, &mut y);
            return y;
        }
        self.blocks.iter().filter(|block| !block.is_zero(x)).for_each(|block| block.forward(x, &mut y));
        self.forward_links(x, &mut y);
        y
    }

    /// The links of L⁻¹·x, of which `y` has the blocks.
    fn forward_links(&self, x: &[f64], y: &mut [f64]) {
        for link in self.links.iter().filter(|link| link.determined) {
            y[link.place] = (x[link.place] - dot(&link.row, y)) / link.diagonal;
        }
    }

    /// L⁻¹·x for several x.
    pub fn forward_all(&self, all: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let together = |several: &[Vec<f64>]| -> Vec<Vec<f64>> {
            // Of two the numbers are not worth putting side by side.
            if several.len() <= 2 {
                return several.iter().map(|x| self.forward(x)).collect();
            }
            let mut solved = vec![vec![0.0; self.at.len()]; several.len()];
            for block in self.blocks.iter().filter(|block| !several.iter().all(|x| block.is_zero(x))) {
                let mut sides = vec![[0.0; TOGETHER]; block.places.len()];
                for (lane, x) in several.iter().enumerate() {
                    sides.iter_mut().zip(block.part(x)).for_each(|(side, x)| side[lane] = x);
                }
                substitute_together(&block.values, &block.determined, &mut sides);
                for (lane, solved) in solved.iter_mut().enumerate() {
                    block.places.iter().zip(&sides).for_each(|(&place, side)| solved[place] = side[lane]);
                }
            }
            several.iter().zip(&mut solved).for_each(|(x, solved)| self.forward_links(x, solved));
            solved
        };
        all.chunks(TOGETHER).flat_map(together).collect()
    }

    /// L⁻ᵀ·y.
    pub fn backward(&self, mut y: Vec<f64>) -> Vec<f64> {
        for link in self.links.iter().rev() {
            if !link.determined {
                y[link.place] = 0.0;
                continue;
            }
            y[link.place] /= link.diagonal;
            let value = y[link.place];
            y.iter_mut().zip(&link.row).for_each(|(y, entry)| *y -= entry * value);
        }
        for block in &self.blocks {
            if !block.is_zero(&y) {
                block.backward(&mut y);
            }
        }
        y
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Pseudo-random, in −0.5 to 0.5.
    fn number(seed: u64, row: usize, column: usize) -> f64 {
        let mixed = (seed + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15)
            ^ ((row * 131 + column) as u64 + 7).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        (mixed ^ (mixed >> 29)) as u32 as f64 / f64::from(u32::MAX) - 0.5
    }

    /// The element of the system of some torques, each of which has columns at some places.
    fn element(torques: &[Vec<usize>], seed: u64, row: usize, column: usize) -> f64 {
        let of_torque = |(torque, places): (usize, &Vec<usize>)| -> f64 {
            let own = |place: usize, sample: usize| number(seed, place, 100 * torque + sample);
            let is_there = places.contains(&row) && places.contains(&column);
            if is_there { (0..40).map(|sample| own(row, sample) * own(column, sample)).sum() } else { 0.0 }
        };
        torques.iter().enumerate().map(of_torque).sum()
    }

    /// The factor of that system, beginning with `kept` rows of another.
    fn factored(
        (size, model): (usize, usize),
        torques: &[Vec<usize>],
        seed: u64,
        start: Option<(&Blocks, usize)>,
    ) -> (Blocks, Vec<bool>) {
        let mut blocks = Blocks::of_zeros(size, model, torques);
        let kept = start.map_or(0, |(_, kept)| kept);
        if let Some((start, kept)) = start {
            blocks.keep(start, kept);
        }
        for row in 0..size {
            for column in 0..size {
                let is_its = match (blocks.is_link(row), blocks.is_link(column)) {
                    (true, other) => !other || column <= row,
                    (false, other) => !other && column <= row && row >= kept,
                };
                if is_its
                    && let value = element(torques, seed, row, column)
                    && value != 0.0
                {
                    blocks.add(row, column, value);
                }
            }
        }
        let mut determined = vec![true; size];
        blocks.factor(kept, &mut determined, |_| 1e-8);
        (blocks, determined)
    }

    proptest! {
        /// Torques of three limbs, of two joints each; the first places are their bodies', the next act on
        /// one torque, some on torques of two limbs, and one on none.
        #[test]
        fn blocks_solve_the_system(
            bodies in prop::collection::vec(0_usize..3, 3..12),
            effects in prop::collection::vec((0_usize..6, 0_usize..6), 0..10),
            kept in 0_usize..24,
            seed in 0_u64..1000,
        ) {
            let (model, size) = (bodies.len(), bodies.len() + effects.len() + 1);
            let mut torques = vec![Vec::new(); 6];
            for (place, limb) in bodies.iter().enumerate() {
                torques[2 * limb].push(place);
                if place % 2 == 0 {
                    torques[2 * limb + 1].push(place);
                }
            }
            let before: Vec<Vec<usize>> = torques.clone();
            for (place, &(one, other)) in effects.iter().enumerate() {
                torques[one].push(model + place);
                if place % 3 == 0 && one != other {
                    torques[other].push(model + place);
                }
            }
            let (start, _) = factored((size, model), &before, seed, None);
            for start in [None, Some((&start, kept.min(model)))] {
                let (blocks, determined) = factored((size, model), &torques, seed, start);
                let acts = |place: usize| torques.iter().any(|places| places.contains(&place));
                let expected: Vec<bool> = (0..size).map(acts).collect();
                prop_assert_eq!(&determined, &expected);
                let x: Vec<Vec<f64>> = (0..5)
                    .map(|side| (0..size).map(|place| number(seed, place, 900 + side)).collect())
                    .collect();
                for (x, half) in x.iter().zip(blocks.forward_all(&x)) {
                    let alone = blocks.forward(x);
                    prop_assert!(alone.iter().zip(&half).all(|(a, b)| (a - b).abs() < 1e-9 * (1.0 + a.abs())));
                    let solution = blocks.backward(half);
                    for row in (0..size).filter(|&row| expected[row]) {
                        let product: f64 =
                            (0..size).map(|column| element(&torques, seed, row, column) * solution[column]).sum();
                        prop_assert!((product - x[row]).abs() < 1e-7, "{product} {}", x[row]);
                    }
                }
            }
        }
    }

    #[test]
    fn limbs_are_blocks_and_what_acts_on_two_of_them_comes_after() {
        // Two bodies, on torques 0 and 1 and on torque 2; then effects of one torque each, a coupling of
        // torques 1 and 2, and one of torques 0 and 1, which are of one limb.
        let torques = [vec![0, 2, 5], vec![0, 4, 5], vec![1, 3, 4]];
        let blocks = Blocks::of_zeros(7, 2, &torques);
        let places: Vec<&[usize]> = blocks.blocks.iter().map(|block| block.places.as_slice()).collect();
        assert_eq!(places, [&[0, 2, 5][..], &[1, 3], &[6]]);
        assert_eq!(blocks.links.iter().map(|link| link.place).collect::<Vec<_>>(), [4]);
    }
}
