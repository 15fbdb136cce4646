//! From a binary tree to a plan of eight-wide nodes and leaves of whole blocks.
//!
//! Dynamic programming after Ylitie, Karras & Laine 2017, "Efficient Incoherent Ray Traversal on
//! GPUs Through Compressed Wide BVHs", §3.2: with A(n) the half area of a subtree's box and C(n, i)
//! the least cost of representing subtree n by at most i roots,
//!
//! - C(n, 1) = min(A(n)·c_leaf(n), A(n)·c_node + D(n, 8)),
//! - C(n, i) = min(C(n, i−1), D(n, i)),
//! - D(n, j) = min over k of C(left, k) + C(right, j−k).
//!
//! A block of eight triangles costs the same however many of its lanes are used, so c_leaf counts
//! blocks. That fills leaves better than collapsing triangle by triangle.

use super::layout::{ANALYTIC_LEAF, WIDTH};

/// Cost of visiting a node, relative to testing one block of triangles, where the tree stays in the
/// caches close to the processor.
const NODE_COST: f32 = 1.0;
/// The same for large trees, where waiting for memory outweighs arithmetic.
const FAR_NODE_COST: f32 = 3.0;
/// Number of primitives from which on a tree counts as large: about 1 MB.
const LARGE: usize = 16_384;
/// Least area of a subtree in parts of the whole: products with costs stay above 0.
const MIN_AREA: f64 = 1e-30;
/// Cost of testing one block of triangles.
const BLOCK_COST: f32 = 1.0;
/// Cost of testing one analytic primitive.
const ANALYTIC_COST: f32 = 0.5;

/// Binary node: children `first` and `first + 1` where `count` is 0, else a run of `order`.
#[derive(Clone, Copy)]
pub(super) struct BinNode {
    pub min: [f32; 3],
    pub max: [f32; 3],
    pub first: u32,
    pub count: u32,
}

/// Binary tree with its root at 0 and the primitives of its leaves.
pub(super) struct BinTree {
    pub nodes: Vec<BinNode>,
    pub order: Vec<u32>,
}

impl BinNode {
    pub fn children(&self) -> Option<(usize, usize)> {
        (self.count == 0).then_some((self.first as usize, self.first as usize + 1))
    }

    pub fn half_area(&self) -> f64 {
        let e = [0, 1, 2].map(|i| f64::from(self.max[i]) - f64::from(self.min[i]));
        e[0] * e[1] + e[1] * e[2] + e[2] * e[0]
    }
}

impl BinTree {
    /// Node indices, parents before children.
    fn preorder(&self) -> Vec<u32> {
        let mut out = Vec::with_capacity(self.nodes.len());
        let mut stack = vec![0_u32];
        while let Some(n) = stack.pop() {
            out.push(n);
            if let Some((l, r)) = self.nodes[n as usize].children() {
                stack.push(r as u32);
                stack.push(l as u32);
            }
        }
        out
    }

    /// Sets the bounds of all nodes by those of the elements of `order`.
    pub fn refit(&mut self, bounds: impl Fn(u32) -> ([f32; 3], [f32; 3])) {
        let union = |a: ([f32; 3], [f32; 3]), b: ([f32; 3], [f32; 3])| {
            ([0, 1, 2].map(|i| a.0[i].min(b.0[i])), [0, 1, 2].map(|i| a.1[i].max(b.1[i])))
        };
        for n in self.preorder().into_iter().rev() {
            let node = self.nodes[n as usize];
            let (min, max) = match node.children() {
                Some((l, r)) => {
                    let (l, r) = (self.nodes[l], self.nodes[r]);
                    union((l.min, l.max), (r.min, r.max))
                }
                None => self.order[node.first as usize..][..node.count as usize]
                    .iter()
                    .map(|&i| bounds(i))
                    .fold(([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]), union),
            };
            self.nodes[n as usize] = BinNode { min, max, ..node };
        }
    }

    /// Primitives below a node, ascending.
    pub fn prims(&self, n: usize, out: &mut Vec<u32>) {
        out.clear();
        let mut stack = vec![n];
        while let Some(n) = stack.pop() {
            let node = &self.nodes[n];
            match node.children() {
                Some((l, r)) => stack.extend([l, r]),
                None => {
                    out.extend_from_slice(&self.order[node.first as usize..][..node.count as usize])
                }
            }
        }
        out.sort_unstable();
    }
}

/// The least costs C(n, i) and which subtrees become leaves.
pub(super) struct Plan<'a> {
    tree: &'a BinTree,
    cost: Vec<[f32; WIDTH - 1]>,
    leaf: Vec<bool>,
}

/// What a subtree holds.
#[derive(Clone, Copy, Default)]
struct Content {
    triangles: u32,
    analytic: u32,
}

impl<'a> Plan<'a> {
    /// Plans the collapse; `triangles` is the number of triangle ids, which come first.
    pub fn new(tree: &'a BinTree, triangles: usize) -> Self {
        let len = tree.nodes.len();
        let mut plan = Plan { tree, cost: vec![[0.0; WIDTH - 1]; len], leaf: vec![false; len] };
        // Two blocks a leaf fill the lanes better, which pays where memory is what is short.
        let (node_cost, blocks) =
            if tree.order.len() < LARGE { (NODE_COST, 1) } else { (FAR_NODE_COST, 2) };
        let mut content = vec![Content::default(); len];
        let whole = tree.nodes[0].half_area();
        for &n in tree.preorder().iter().rev() {
            let n = n as usize;
            let node = &tree.nodes[n];
            // Parts of the whole, so that no unit makes them overflow.
            let area = (node.half_area() / whole).max(MIN_AREA) as f32;
            if let Some((l, r)) = node.children() {
                let (cl, cr) = (content[l], content[r]);
                let here = Content {
                    triangles: cl.triangles + cr.triangles,
                    analytic: cl.analytic + cr.analytic,
                };
                content[n] = here;
                let mut c = [0.0; WIDTH - 1];
                let as_leaf = leaf_cost(here, blocks) * area;
                let as_node = node_cost * area + plan.distribute(l, r, WIDTH).0;
                plan.leaf[n] = as_leaf <= as_node;
                c[0] = as_leaf.min(as_node);
                for i in 2..WIDTH {
                    c[i - 1] = c[i - 2].min(plan.distribute(l, r, i).0);
                }
                plan.cost[n] = c;
            } else {
                let prims = &tree.order[node.first as usize..][..node.count as usize];
                let t = prims.iter().filter(|p| (**p as usize) < triangles).count() as u32;
                content[n] = Content { triangles: t, analytic: node.count - t };
                plan.leaf[n] = true;
                plan.cost[n] = [leaf_cost(content[n], blocks) * area; WIDTH - 1];
            }
        }
        plan
    }

    /// D(n, j) and the k that attains it first.
    fn distribute(&self, l: usize, r: usize, j: usize) -> (f32, usize) {
        let mut best = (f32::INFINITY, 1);
        for k in 1..j {
            if k < WIDTH && j - k < WIDTH {
                let c = self.cost[l][k - 1] + self.cost[r][j - k - 1];
                if c < best.0 {
                    best = (c, k);
                }
            }
        }
        best
    }

    /// Whether subtree `n`, as a single root, is a leaf.
    pub fn is_leaf(&self, n: usize) -> bool {
        self.leaf[n]
    }

    /// The at most eight subtrees that become the children of the wide node at `n`.
    pub fn wide_children(&self, n: usize, out: &mut Vec<usize>) {
        out.clear();
        match self.tree.nodes[n].children() {
            Some((l, r)) => {
                let (_, k) = self.distribute(l, r, WIDTH);
                self.roots(l, k, out);
                self.roots(r, WIDTH - k, out);
            }
            None => out.push(n),
        }
    }

    fn roots(&self, n: usize, budget: usize, out: &mut Vec<usize>) {
        let c = &self.cost[n];
        let mut i = budget;
        while i > 1 && c[i - 1] == c[i - 2] {
            i -= 1;
        }
        match self.tree.nodes[n].children() {
            Some((l, r)) if i > 1 => {
                let (_, k) = self.distribute(l, r, i);
                self.roots(l, k, out);
                self.roots(r, i - k, out);
            }
            _ => out.push(n),
        }
    }
}

fn leaf_cost(c: Content, blocks: usize) -> f32 {
    let (t, a) = (c.triangles as usize, c.analytic as usize);
    if a == 0 && t <= blocks * WIDTH {
        t.div_ceil(WIDTH) as f32 * BLOCK_COST
    } else if t == 0 && a <= ANALYTIC_LEAF {
        a as f32 * ANALYTIC_COST
    } else {
        f32::INFINITY
    }
}
