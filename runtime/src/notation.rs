//! Letters, frames and where they come from (documentation only).
//!
//! The algorithm is that of J. Naudet, *Forward Dynamics of Multibody Systems: A Recursive Hamiltonian Approach*, Vrije
//! Universiteit Brussel, 2005; numbers in parentheses at the end of a line are its equations. Spatial vectors are
//! `[linear; angular]`, in body axes, velocities and moments taken at the frame origin. Featherstone writes them the
//! other way round.
//!
//! | here | thesis | Featherstone | meaning |
//! | --- | --- | --- | --- |
//! | steps of a node, `X_i` | `T^V` | `ⁱX_λ` | velocity transform from the parent's frame; its transpose carries forces back |
//! | `E_i`, [`Freedom`](crate::tree::Freedom) | `E` | `S_i` | joint matrix, one column for each freedom |
//! | `Ω_i`, `omega` | `Ω` | `v_i` | spatial velocity |
//! | `Ω̂_i`, `hat` | `T^V Ω` | | velocity of the node frame before its own freedoms |
//! | `M_i`, [`RigidInertia`](crate::spatial::RigidInertia) | `M` | `I_i` | body inertia: mass, first moment, inertia about the frame origin |
//! | `M*_i`, `M'_i` | `M*`, `M'` | `I^A`, `I^a` | articulated inertia, before and after the node's own freedoms are eliminated |
//! | `U`, `Mj`, `k` | | `U`, `D`, `U D⁻¹` | `M* E`, `Eᵀ M* E`, `U / Mj` |
//! | `P*_i` | `P*` | | articulated momentum: what the joint transmits, as a wrench is transmitted |
//! | `D_i`, `D'_i` | `D`, `D'` | `p^A`, `p^a` | momentum remainder, before and after elimination: `P* = M'Ω̂ + D'` |
//! | `T*_i` | `T*` | | external wrench on the subtree |
//! | `q, v, p, τ` | `q, q̇, p, τ` | `q, q̇, –, τ` | coordinates, velocities, canonical momenta, joint forces |
//!
//! Two zeros are structure and never computed: `EᵀM' = 0` and `EᵀD' = p` (a rotor's inertia `I_a` on the joint makes
//! them `I_a kᵀ` and `p − I_a e`). Gravity is a force on subtrees through their first moments; there is no acceleration
//! in the canonical form to hide it in.
//!
//! Joints whose velocities are not coordinate rates (spherical, floating, planar) take velocities and momenta in body
//! axes: `π = EᵀP*` and `π̇ = Eᵀ(T* − Ω × P*) + τ`, `q̇ = N(q) v` with (A.58) for unit quaternions `(x, y, z, w)`.
