//! Modes of collocation methods: they split the equations of the stages into ones of the size of the state.
//!
//! `scripts/collocation.py` computes them, to 36 digits.

use crate::constant::{list, Constant};

/// An eigenvalue `μ` of a method's matrix `A`, and its eigenvectors, real parts before imaginary ones. Of a pair of
/// complex ones it is that with positive imaginary part.
///
/// `A = Σ Re(right · μ · left)` over the modes. So the solution of `(1 − h A ⊗ J) z = r` is `z_i = Σ Re(right_i y)`
/// with `(1 − h μ J) y = Σ_i left_i r_i`. E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, section
/// IV.8.
#[derive(Clone, Copy, Debug)]
pub struct Mode<const S: usize> {
    /// The eigenvalue.
    pub value: [Constant; 2],
    /// Right eigenvector.
    pub right: [[Constant; S]; 2],
    /// Left eigenvector.
    pub left: [[Constant; S]; 2],
}

/// Mode of the implicit midpoint rule.
pub static IMPLICIT_MIDPOINT_MODES: [Mode<1>; 1] =
    [Mode { value: list("1/2 0"), right: [list("1"), list("0")], left: [list("1"), list("0")] }];

/// Mode of the backward Euler method.
pub static BACKWARD_EULER_MODES: [Mode<1>; 1] =
    [Mode { value: list("1 0"), right: [list("1"), list("0")], left: [list("1"), list("0")] }];

/// Modes of Gauss-Legendre 4.
pub static GAUSS4_MODES: [Mode<2>; 1] = [Mode {
    value: list("0.25 0.144337567297406441127287195125489364"),
    right: [list("0 1"), list("0.267949192431122706472553658494127633 0")],
    left: [list("0 1"), list("-3.73205080756887729352744634150587237 0")],
}];

/// Modes of Gauss-Legendre 6.
pub static GAUSS6_MODES: [Mode<3>; 2] = [
    Mode {
        value: list("0.215314423116112178244733530380695471 0"),
        right: [
            list("0.0721518520552001703208176992439744815 0.118832578741277807070888819373029276 1"),
            list("0 0 0"),
        ],
        left: [
            list(
                "5.99169808493780077564958074398128865 1.13921429515573544456700223693400946 \
              0.432312113783858385569637590118049784",
            ),
            list("0 0 0"),
        ],
    },
    Mode {
        value: list("0.142342788441943910877633234809652265 0.135799925708153803069122705259688146"),
        right: [
            list("-0.0822412305736306706486620659751627986 0.0530650907420613950461441137395750806 1"),
            list("-0.0601207386193085017308594892143879162 0.316205051132291573222486292618269899 0"),
        ],
        left: [
            list(
                "-5.99169808493780077564958074398128865 -1.13921429515573544456700223693400946 \
              0.567687886216141614430362409881950216",
            ),
            list(
                "1.24621327358623141081557164049308109 -2.9255596461923136625992303670549727 \
              0.257735201273432492346872283688824574",
            ),
        ],
    },
];

/// Modes of Radau IIA 5.
pub static RADAU5_MODES: [Mode<3>; 2] = [
    Mode {
        value: list("0.274888829595677367747828603599414779 0"),
        right: [
            list("0.0944387624889752414874900795064165863 0.250213122965333311376509067512501684 1"),
            list("0 0 0"),
        ],
        left: [
            list(
                "4.17871859155190472734646265851205623 0.327682820761062387082533272429616234 \
              0.523376445499449548039930915908987502",
            ),
            list("0 0 0"),
        ],
    },
    Mode {
        value: list("0.16255558520216131612608569820029261 0.184949324407140784275091223743802506"),
        right: [
            list("-0.141255295020954208427990383807797309 0.204129352293799931995990810298338174 1"),
            list("-0.0300291941051474244918611170890538667 0.38294211275726193779543823359987321 0"),
        ],
        left: [
            list(
                "-4.17871859155190472734646265851205623 -0.327682820761062387082533272429616234 \
              0.476623554500550451960069084091012498",
            ),
            list(
                "0.502872634945786875951247343139544293 -2.57192694985560542918678535360167505 \
              0.596039204828224924968821911099302403",
            ),
        ],
    },
];
