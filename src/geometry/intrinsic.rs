//! A triangulation that knows its edges' lengths and not where its corners are, made fit for cotangents: mollified, doubled
//! where it has borders, then flipped until it is Delaunay [Sharp2020].
//!
//! Scans bring triangles whose angles f32 cannot tell from 0. Adding the same tiny length to every edge of a component
//! makes the worst of them a proper triangle (mollification: 1e-5 of the component's mean edge at most); flipping edges
//! within the surface, which stays as it is, then leaves no two angles across an edge that add up to more than 180
//! degrees.
//!
//! Where they add up to just that, either diagonal will do, and rounding or the order of the triangles says which. So nothing
//! may be asked of it that depends on that: not a third of a triangle's area, but what lies nearest to each of its corners
//! ([`Intrinsic::nearest`]), which is the surface's own, as its cotangents are [Bobenko2007].
//!
//! An edge of one triangle or of more than two has nothing to be flipped with, nor has one that a one-sided surface passes
//! with its sides exchanged. A surface that has such edges becomes a thing of two sheets, front and back, which hang
//! together there; the rest of it does too, so that each sheet stands for half.

/// No triangle lies across: a border, an edge of many triangles, or one where sides are exchanged.
const NONE: u32 = u32::MAX;

/// How much longer than the third edge two edges of a triangle have to be together, of the component's mean edge.
const SLACK: f64 = 1e-5;

/// Two angles across an edge are as good as 180 degrees together if the sum of their cotangents is this near to 0.
const UNDECIDED: f64 = 1e-10;

/// Triangles with the lengths of their edges. Side i of a triangle runs from its corner i to the next one.
pub(super) struct Intrinsic {
    pub corners: Vec<[u32; 3]>,
    pub lengths: Vec<[f64; 3]>,
    /// How often each piece of the surface is there: twice, if it has borders.
    pub sheets: f64,
    /// For each side (3 t + i) the one across.
    across: Vec<u32>,
}

impl Intrinsic {
    /// From triangles that have three different corners each, the lengths of their sides, and their components.
    pub fn new(corners: Vec<[u32; 3]>, lengths: Vec<[f64; 3]>, component: &[u32]) -> Intrinsic {
        let mut intrinsic = Intrinsic::glued(corners, lengths);
        intrinsic.mollify(component);
        intrinsic.close();
        intrinsic.flip_to_delaunay();
        intrinsic
    }

    fn glued(corners: Vec<[u32; 3]>, lengths: Vec<[f64; 3]>) -> Intrinsic {
        let mut intrinsic = Intrinsic { across: vec![NONE; 3 * corners.len()], corners, lengths, sheets: 1.0 };
        intrinsic.glue();
        intrinsic
    }

    /// Pairs the sides of edges that have two triangles, and turns triangles so that both run along such an edge in
    /// opposite directions.
    fn glue(&mut self) {
        let mut sides: Vec<(u32, u32, u32)> = Vec::with_capacity(self.across.len());
        for (t, corners) in self.corners.iter().enumerate() {
            for i in 0..3 {
                let (a, b) = (corners[i], corners[(i + 1) % 3]);
                sides.push((a.min(b), a.max(b), (3 * t + i) as u32));
            }
        }
        sides.sort_unstable();
        for edge in sides.chunk_by(|one, other| (one.0, one.1) == (other.0, other.1)) {
            if let [one, other] = edge {
                self.across[one.2 as usize] = other.2;
                self.across[other.2 as usize] = one.2;
            }
        }
        let mut turned: Vec<Option<bool>> = vec![None; self.corners.len()];
        let mut next = Vec::new();
        for first in 0..self.corners.len() {
            if turned[first].is_none() {
                turned[first] = Some(false);
                next.push(first);
            }
            while let Some(t) = next.pop() {
                for side in 3 * t..3 * t + 3 {
                    let other = self.across[side];
                    if other == NONE {
                        continue;
                    }
                    let same_way = self.ends(side).0 == self.ends(other as usize).0;
                    let wanted = turned[t].map(|turned| turned ^ same_way);
                    let there = other as usize / 3;
                    if turned[there].is_none() {
                        turned[there] = wanted;
                        next.push(there);
                    } else if turned[there] != wanted {
                        self.across[side] = NONE;
                        self.across[other as usize] = NONE;
                    }
                }
            }
        }
        let is_turned = |t: usize| turned[t] == Some(true);
        let place = |side: u32| match side {
            NONE => NONE,
            side if is_turned(side as usize / 3) => mirrored(side),
            side => side,
        };
        let before = std::mem::take(&mut self.across);
        self.across = vec![NONE; before.len()];
        for (side, &other) in before.iter().enumerate() {
            self.across[place(side as u32) as usize] = place(other);
        }
        for t in (0..self.corners.len()).filter(|&t| is_turned(t)) {
            self.corners[t].swap(1, 2);
            self.lengths[t].reverse();
        }
    }

    /// Adds a back to a surface with borders, of the same triangles turned over, and joins both there.
    fn close(&mut self) {
        if !self.across.contains(&NONE) {
            return;
        }
        let front = self.across.clone();
        let behind = |side: u32| front.len() as u32 + mirrored(side);
        self.corners.extend(self.corners.clone().into_iter().map(|[a, b, c]| [a, c, b]));
        self.lengths.extend(self.lengths.clone().into_iter().map(|[ab, bc, ca]| [ca, bc, ab]));
        self.across.resize(2 * front.len(), NONE);
        for (side, &other) in (0..).zip(&front) {
            let (here, there) = if other == NONE { (behind(side), side) } else { (other, behind(other)) };
            self.across[side as usize] = here;
            self.across[behind(side) as usize] = there;
        }
        self.sheets = 2.0;
    }

    fn ends(&self, side: usize) -> (u32, u32) {
        let corners = self.corners[side / 3];
        (corners[side % 3], corners[(side % 3 + 1) % 3])
    }

    /// Adds to every edge of a component what its worst triangle lacks.
    fn mollify(&mut self, component: &[u32]) {
        let of = |corners: &[u32; 3]| component[corners[0] as usize] as usize;
        let count = component.iter().max().map_or(0, |last| *last as usize + 1);
        let (mut total, mut sides) = (vec![0.0; count], vec![0.0; count]);
        for (corners, lengths) in self.corners.iter().zip(&self.lengths) {
            total[of(corners)] += lengths.iter().sum::<f64>();
            sides[of(corners)] += 3.0;
        }
        let mut lacking = vec![0.0f64; count];
        for (corners, lengths) in self.corners.iter().zip(&self.lengths) {
            let c = of(corners);
            let longest = lengths.iter().copied().fold(0.0, f64::max);
            let over = lengths.iter().sum::<f64>() - 2.0 * longest;
            lacking[c] = lacking[c].max(SLACK * total[c] / sides[c] - over);
        }
        for (corners, lengths) in self.corners.iter().zip(&mut self.lengths) {
            lengths.iter_mut().for_each(|length| *length += lacking[of(corners)]);
        }
    }

    fn flip_to_delaunay(&mut self) {
        let mut suspects: Vec<u32> = (0..self.across.len() as u32).rev().collect();
        // Every flip lowers the energy of any function on the corners, so that there is an end to it but for rounding.
        let mut left = 100 * self.corners.len();
        while let Some(side) = suspects.pop() {
            let other = self.across[side as usize];
            if other == NONE || other / 3 == side / 3 || left == 0 {
                continue;
            }
            let (here, there) = (self.cotangent(side as usize), self.cotangent(other as usize));
            if here + there < -UNDECIDED * (1.0 + here.abs() + there.abs())
                && let Some(outer) = self.flip(side, other)
            {
                left -= 1;
                suspects.extend(outer);
            }
        }
    }

    /// Of the angle that lies opposite a side.
    pub fn cotangent(&self, side: usize) -> f64 {
        let lengths = self.lengths[side / 3];
        let [l, m, n] = [0, 1, 2].map(|i| lengths[(side + i) % 3]);
        (m * m + n * n - l * l) / (4.0 * area(&lengths))
    }

    pub fn area(&self, t: usize) -> f64 {
        area(&self.lengths[t])
    }

    /// Of what lies nearest to each corner of a triangle, the area, if all around it is Delaunay: that is what the lines to the
    /// middle of its circumcircle cut off. Of an obtuse triangle, some is another's, and counts as negative. All three add
    /// up to its area.
    pub fn nearest(&self, t: usize) -> [f64; 3] {
        let along = [0, 1, 2].map(|i| self.lengths[t][i].powi(2) * self.cotangent(3 * t + i) / 8.0);
        [along[0] + along[2], along[1] + along[0], along[2] + along[1]]
    }

    /// Exchanges the edge a b between the triangles a b c and b a d for c d, and tells the four sides around the two.
    fn flip(&mut self, side: u32, other: u32) -> Option<[u32; 4]> {
        let (f, g) = (side / 3, other / 3);
        let turn = |side: u32, by: u32| side - side % 3 + (side % 3 + by) % 3;
        let (bc, ca) = (turn(side, 1), turn(side, 2));
        let (ad, db) = (turn(other, 1), turn(other, 2));
        let length = |side: u32| self.lengths[side as usize / 3][side as usize % 3];
        let (l, l_bc, l_ca, l_ad, l_db) = (length(side), length(bc), length(ca), length(ad), length(db));
        // Laid out with a at the origin and b on the x axis; c lies above it and d below.
        let along = |near: f64, far: f64| (l * l + near * near - far * far) / (2.0 * l);
        let height = |t: u32| 2.0 * self.area(t as usize) / l;
        let across = (along(l_ca, l_bc) - along(l_ad, l_db)).hypot(height(f) + height(g));
        let (left, right) = ([l_ca, l_ad, across], [l_db, l_bc, across]);
        if !(area(&left) > 0.0 && area(&right) > 0.0) {
            return None;
        }
        let (a, b) = self.ends(side as usize);
        let (c, d) = (self.ends(ca as usize).0, self.ends(db as usize).0);
        // c a d and d b c. What lies beyond the four outer sides may be one of these sides itself.
        let moved = |beyond: u32| match beyond {
            s if s == ca => 3 * f,
            s if s == ad => 3 * f + 1,
            s if s == db => 3 * g,
            s if s == bc => 3 * g + 1,
            s => s,
        };
        let beyond = [ca, ad, db, bc].map(|side| moved(self.across[side as usize]));
        let outer = [3 * f, 3 * f + 1, 3 * g, 3 * g + 1];
        for (side, beyond) in outer.into_iter().zip(beyond) {
            self.across[side as usize] = beyond;
            if beyond != NONE {
                self.across[beyond as usize] = side;
            }
        }
        self.across[3 * f as usize + 2] = 3 * g + 2;
        self.across[3 * g as usize + 2] = 3 * f + 2;
        self.corners[f as usize] = [c, a, d];
        self.corners[g as usize] = [d, b, c];
        self.lengths[f as usize] = left;
        self.lengths[g as usize] = right;
        Some(outer)
    }
}

/// The place of a side in its triangle turned over: a b c becomes a c b, its sides in reverse.
fn mirrored(side: u32) -> u32 {
    side - side % 3 + (2 - side % 3)
}

/// By Heron, in the order of operations that keeps its digits for needles; 0 for what is no triangle.
fn area(lengths: &[f64; 3]) -> f64 {
    let mut sorted = *lengths;
    sorted.sort_unstable_by(|a, b| b.total_cmp(a));
    let [a, b, c] = sorted;
    let product = (a + (b + c)) * (c - (a - b)) * (c + (a - b)) * (a + (b - c));
    0.25 * product.max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two triangles over the diagonal of a kite that is 2 wide and `height` high.
    fn kite(height: f64) -> Intrinsic {
        let side = (1.0f64 + 0.25 * height * height).sqrt();
        Intrinsic::new(vec![[0, 1, 2], [1, 0, 3]], vec![[2.0, side, side]; 2], &[0; 4])
    }

    #[test]
    fn areas_are_exact_for_needles() {
        assert!((area(&[3.0, 4.0, 5.0]) - 6.0).abs() < 1e-15);
        let needle = area(&[1.0, 1.0, 1e-9]);
        assert!((needle / 0.5e-9 - 1.0).abs() < 1e-12, "{needle}");
        assert_eq!(area(&[1.0, 2.0, 3.5]), 0.0);
    }

    #[test]
    fn a_flat_kite_is_flipped_and_a_high_one_is_not() {
        let flat = kite(0.5);
        assert!(flat.corners.iter().all(|t| t.contains(&2) && t.contains(&3)), "{:?}", flat.corners);
        assert!(flat.lengths.iter().all(|l| l.iter().any(|l| (l - 0.5).abs() < 1e-12)));
        assert!((flat.area(0) + flat.area(1) - 0.5).abs() < 1e-12);
        let high = kite(3.0);
        assert!(high.corners.iter().all(|t| t.contains(&0) && t.contains(&1)));
    }

    #[test]
    fn what_is_nearest_to_a_corner_is_the_same_by_either_diagonal() {
        type Corners = [(f64, f64); 4];
        // Both on a circle.
        let rectangle = [(0.0, 0.0), (3.0, 0.0), (3.0, 1.0), (0.0, 1.0)];
        let trapezoid = [(0.0, 0.0), (4.0, 0.0), (3.0, 1.0), (1.0, 1.0)];
        let areas = |at: Corners, triangles: [[u32; 3]; 2], by: fn(&Intrinsic, usize) -> [f64; 3]| {
            let length = |i: u32, j: u32| {
                let (a, b) = (at[i as usize], at[j as usize]);
                (a.0 - b.0).hypot(a.1 - b.1)
            };
            let lengths = triangles.map(|[a, b, c]| [length(a, b), length(b, c), length(c, a)]);
            let found = Intrinsic::new(triangles.to_vec(), lengths.to_vec(), &[0; 4]);
            let mut areas = [0.0; 4];
            for (t, corners) in found.corners.iter().enumerate() {
                corners.iter().zip(by(&found, t)).for_each(|(&v, area)| areas[v as usize] += area / found.sheets);
            }
            assert!(
                (areas.iter().sum::<f64>() - 3.0).abs() < 1e-9 && areas.iter().all(|area| *area > 0.1),
                "{areas:?}"
            );
            areas
        };
        let apart = |at, by| {
            let [a, b] = [[[0, 1, 2], [0, 2, 3]], [[0, 1, 3], [1, 2, 3]]].map(|triangles| areas(at, triangles, by));
            a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        };
        assert!(apart(rectangle, Intrinsic::nearest) < 1e-9 && apart(trapezoid, Intrinsic::nearest) < 1e-9);
        assert!(apart(rectangle, |found, t| [found.area(t) / 3.0; 3]) > 0.1, "thirds are not");
    }

    #[test]
    fn flat_triangles_become_proper_ones_and_others_stay() {
        // The middle of an edge is a corner of a triangle without area.
        let flat = Intrinsic::new(vec![[0, 1, 2]], vec![[0.5, 0.5, 1.0]], &[0; 3]);
        assert!(flat.area(0) > 0.0 && (0..3).all(|side| flat.cotangent(side).abs() < 1e3));
        let even = Intrinsic::new(vec![[0, 1, 2]], vec![[1.0; 3]], &[0; 3]);
        assert_eq!(even.lengths[0], [1.0; 3]);
    }

    #[test]
    fn triangles_are_turned_to_agree_and_a_one_sided_band_is_cut() {
        let agree = Intrinsic::glued(vec![[0, 1, 2], [0, 1, 3]], vec![[1.0; 3]; 2]);
        assert!(agree.across.iter().filter(|s| **s != NONE).count() == 2);
        let (a, b) = (agree.ends(0), agree.ends(agree.across[0] as usize));
        assert_eq!((a.0, a.1), (b.1, b.0));
        // A band of five triangles whose ends are joined with a half turn.
        let band: Vec<[u32; 3]> = (0..5).map(|i| [i, (i + 1) % 5, (i + 2) % 5]).collect();
        let mut band = Intrinsic::glued(band, vec![[1.0; 3]; 5]);
        assert!(band.across.contains(&NONE));
        let is_glued = |band: &Intrinsic| {
            for (side, &other) in band.across.iter().enumerate().filter(|(_, other)| **other != NONE) {
                let ((a, b), (c, d)) = (band.ends(side), band.ends(other as usize));
                assert_eq!((band.across[other as usize], a, b), (side as u32, d, c));
                assert_eq!(band.lengths[side / 3][side % 3], band.lengths[other as usize / 3][other as usize % 3]);
            }
        };
        is_glued(&band);
        band.close();
        is_glued(&band);
        assert!(!band.across.contains(&NONE) && band.corners.len() == 10);
    }
}
