//! Letters and frames, and their sources (documentation only).
//!
//! The algorithm is that of J. Naudet, *Forward Dynamics of Multibody Systems: A Recursive Hamiltonian Approach*, Vrije
//! Universiteit Brussel, 2005; numbers in parentheses at the end of a line are its equations. Spatial vectors are
//! `[linear; angular]`, in body axes; velocities and moments are taken at the frame origin. Featherstone writes
//! `[angular; linear]`.
//!
//! | here | thesis | Featherstone | meaning |
//! | --- | --- | --- | --- |
//! | elementary transforms of a node, `X_i` | `T^V` | `ⁱX_λ` | velocity transform from the parent's frame; its transpose takes forces to the parent's frame |
//! | `E_i`, [`Freedom`](crate::tree::Freedom) | `E` | `S_i` | joint matrix, one column for each degree of freedom |
//! | `Ω_i`, `omega` | `Ω` | `v_i` | spatial velocity |
//! | `Ω̂_i`, `hat` | `T^V Ω` | | velocity of the node frame with the node's own joint at rest |
//! | `M_i`, [`RigidInertia`](crate::spatial::RigidInertia) | `M` | `I_i` | body inertia: mass, first moment, inertia about the frame origin |
//! | `M*_i`, `M'_i` | `M*`, `M'` | `I^A`, `I^a` | articulated inertia, before and after the node's own degrees of freedom are eliminated |
//! | `U`, `Mj`, `k` | | `U`, `D`, `U D⁻¹` | `M* E`, `Eᵀ M* E`, `U / Mj` |
//! | `P*_i` | `P*` | | articulated momentum: the momentum that the joint transmits to the subtree |
//! | `D_i`, `D'_i` | `D`, `D'` | `p^A`, `p^a` | bias momentum, before and after elimination: `P* = M'Ω̂ + D'` |
//! | `T*_i` | `T*` | | external wrench on the subtree |
//! | `q, v, p, τ` | `q, q̇, p, τ` | `q, q̇, –, τ` | coordinates, velocities, canonical momenta, joint forces |
//!
//! Two identities hold by structure and are never computed: `EᵀM' = 0` and `EᵀD' = p` (with a rotor's inertia `I_a` on
//! the joint they are `I_a kᵀ` and `p − I_a e`). Gravity acts on subtrees as a force through their first moments. The
//! canonical form has no acceleration to which it could be added, as other algorithms add it to the acceleration of the
//! base.
//!
//! Generated code writes the letters in ASCII behind the body: `m` is `M*`, `mp` `M'`, `u`, `k` and `rho` are `U`, `k`
//! and `1 / Mj`, `d`, `dp` and `e` are `D`, `D'` and `(p − d) / Mj`, `hat` and `omega` are `Ω̂` and `Ω`, `v` is the
//! rate of the joint, `p` is `P*`, `g` gravity, `s` the first moment of the subtree. Entries are `x`, `y`, `z` of the
//! linear and `rx`, `ry`, `rz` of the angular part, pairs of them in inertias: `forearm_m_rx_z`. A name with `minus` is
//! the negative; `t0`, `t1` are sums and products on the way.
//!
//! Joints whose velocities are not coordinate rates (spherical, floating, planar) take velocities and momenta in body
//! axes: `π = EᵀP*` and `π̇ = Eᵀ(T* − Ω × P*) + τ`, `q̇ = N(q) v` with (A.58) for unit quaternions `(x, y, z, w)`.
