//! Sine and cosine in C: the main path from the runtime's functions, and the reduction of large angles.

use mbd_runtime::trig::{QUARTER_PI, TWO_OVER_PI};

use super::instructions::{Value, Writer};
use super::names::{literal, number, Prefix};
use crate::lower::{limit, reduced, within_quadrant};
use crate::options::{AngleRange, Arithmetic, Options, Precision};

/// The functions for one angle and, if it is called, for several, and what they need.
pub fn functions(prefix: &Prefix, options: &Options, several: bool) -> String {
    let precision = options.precision;
    let plain = reduced_body(prefix, precision, false);
    let (fma, reduced) = match options.arithmetic {
        Arithmetic::Exact => (String::new(), plain),
        Arithmetic::Fast => {
            let fused = reduced_body(prefix, precision, true);
            let reduced = format!("#ifdef {}_FMA\n{fused}\n#else\n{plain}\n#endif", prefix.upper);
            (fused_operation(prefix, precision), reduced)
        }
    };
    let limit = limit(precision);
    let limit_bits = match precision {
        Precision::F64 => format!("UINT64_C({:#x})", limit.to_bits()),
        Precision::F32 => format!("UINT32_C({:#x})", (limit as f32).to_bits()),
    };
    let words = [
        ("PREFIX", prefix.lower.clone()),
        ("NUMBER", number(precision).to_string()),
        ("LIMIT", literal(limit, precision)),
        ("LIMIT_BITS", limit_bits),
        ("UPPER", prefix.upper.clone()),
        ("ZERO", literal(0.0, precision)),
        ("WITHIN_QUADRANT", quadrant_body(prefix, precision)),
        ("FUSED_OPERATION", fma),
        ("REDUCED", reduced),
        ("HIGH_WORD", high_word(precision).to_string()),
        ("TABLE", table()),
    ];
    let (uint, bits, stored, quarter) = match precision {
        Precision::F64 => ("uint64_t", 64, 52, format!("UINT64_C({QUARTER_PI:#x})")),
        Precision::F32 => ("uint32_t", 32, 23, format!("UINT32_C({:#x})", QUARTER_PI >> 32)),
    };
    let exponent = bits - 1 - stored;
    let numbers = [
        ("UINT", uint.to_string()),
        ("QUARTER_PI", quarter),
        ("QUIET_NAN", format!("((({uint})1 << {}) - 1U) << {}", exponent + 1, stored - 1)),
        ("STORED", stored.to_string()),
        ("TOP", (bits - 1).to_string()),
        ("LOW", (bits - 2).to_string()),
        ("WORDS", (bits / 32).to_string()),
        ("LAST_WORD", (bits / 32 - 1).to_string()),
        ("LARGEST", ((1 << exponent) - 2).to_string()),
        ("SHIFT", ((1 << (exponent - 1)) - 1 + stored - 62).to_string()),
        ("SCALE", ((1 << (exponent - 1)) - bits).to_string()),
        ("REST", (bits - stored - 1).to_string()),
    ];
    let (far, domain) = match options.angles {
        AngleRange::Any => (FAR, "within one unit in the last place for every finite x"),
        AngleRange::Bounded => (NO_NUMBER, "within one unit in the last place; NaN where it is beyond that range"),
    };
    let text = [NEAR, far, &ONE.replace("@DOMAIN@", domain), if several { SEVERAL } else { "" }].concat();
    words.iter().chain(&numbers).fold(text, |text, (word, by)| text.replace(&format!("@{word}@"), by))
}

/// Statements that compute `s` and `c` from `y0` and `y1`.
fn quadrant_body(prefix: &Prefix, precision: Precision) -> String {
    let mut writer = Writer { temporaries: true, ..Writer::new(prefix, precision) };
    let pair = within_quadrant(&mut writer, ["y0", "y1"].map(Value::simple), precision, false);
    for (name, value) in ["s", "c"].into_iter().zip(pair) {
        writer.line(&format!("const {} {name} = {};", number(precision), value.text));
    }
    writer.out.trim_end().to_string()
}

/// The macro of fused multiply-adds where the processor has them.
fn fused_operation(prefix: &Prefix, precision: Precision) -> String {
    let (suffix, builtin) = match precision {
        Precision::F64 => ("FMA", "__builtin_fma"),
        Precision::F32 => ("FMAF", "__builtin_fmaf"),
    };
    format!(
        "
/* Fused multiply-adds where the processor has them; angles are then reduced in fewer operations. */
#if defined(__GNUC__) && (defined(__FP_FAST_{suffix}) || defined(__FMA__))
#define {}_FMA(a, b, c) {builtin}(a, b, c)
#endif
",
        prefix.upper
    )
}

/// Statements that reduce `x` and give the parts on.
fn reduced_body(prefix: &Prefix, precision: Precision, fused: bool) -> String {
    let mut writer = Writer { temporaries: true, fused, ..Writer::new(prefix, precision) };
    let ([y0, y1], [shifted, _]) = reduced(&mut writer, Value::simple("x"), precision, fused);
    let lower = &prefix.lower;
    writer.line(&format!("{lower}_view shifted;"));
    writer.line(&format!("shifted.number = {};", shifted.text));
    writer.line(&format!("{lower}_quadrant({}, {}, shifted.bits, sine, cosine);", y0.text, y1.text));
    writer.out.trim_end().to_string()
}

/// The table of 2/π, eight numbers in each line.
fn table() -> String {
    let lines = TWO_OVER_PI.chunks(8).map(|words| {
        let words: Vec<String> = words.iter().map(|word| format!("0x{word:08x}U")).collect();
        format!("        {}", words.join(", "))
    });
    lines.collect::<Vec<_>>().join(",\n")
}

fn high_word(precision: Precision) -> &'static str {
    match precision {
        Precision::F32 => "    return (uint32_t)(((uint64_t)a * b) >> 32);",
        Precision::F64 => {
            "    const uint64_t a0 = a & 0xffffffffU;
    const uint64_t a1 = a >> 32;
    const uint64_t b0 = b & 0xffffffffU;
    const uint64_t b1 = b >> 32;
    const uint64_t middle = a1 * b0 + ((a0 * b0) >> 32);
    const uint64_t other = a0 * b1 + (middle & 0xffffffffU);
    return a1 * b1 + (middle >> 32) + (other >> 32);"
        }
    }
}

/// The main path, with words between `@` for what depends on the number type.
const NEAR: &str = "
/* A number and its bits. */
typedef union {
    @NUMBER@ number;
    @UINT@ bits;
} @PREFIX@_view;
@FUSED_OPERATION@
/* Functions that are hardly ever called stay out of the others. */
#ifdef __GNUC__
#define @UPPER@_RARE __attribute__((cold, noinline))
#else
#define @UPPER@_RARE
#endif

/* Sine and cosine of y0 + y1 + quadrant * pi/2, for |y0| up to slightly above pi/4. They are exchanged in odd quadrants,
 * and their signs are changed in their bits, so that nothing branches. */
static inline void @PREFIX@_quadrant(
    @NUMBER@ y0, @NUMBER@ y1, @UINT@ quadrant, @NUMBER@ *restrict sine, @NUMBER@ *restrict cosine)
{
    const @UINT@ odd = 0U - (quadrant & 1U);
@WITHIN_QUADRANT@
    @PREFIX@_view turned_sine;
    @PREFIX@_view turned_cosine;
    turned_sine.number = s;
    turned_cosine.number = c;
    const @UINT@ exchanged = (turned_sine.bits ^ turned_cosine.bits) & odd;
    turned_sine.bits ^= exchanged ^ ((quadrant & 2U) << @LOW@);
    turned_cosine.bits ^= exchanged ^ (((quadrant + 1U) & 2U) << @LOW@);
    *sine = turned_sine.number;
    *cosine = turned_cosine.number;
}

/* Sine and cosine of x, rad, for |x| <= @LIMIT@: x is reduced by pi/2 in several parts (Cody and Waite). For other x the
 * results mean nothing. */
static inline void @PREFIX@_near(@NUMBER@ x, @NUMBER@ *restrict sine, @NUMBER@ *restrict cosine)
{
@REDUCED@
}
";

/// What is beyond the main path.
const FAR: &str = "
/* The upper half of a product. */
static @UINT@ @PREFIX@_high(@UINT@ a, @UINT@ b)
{
@HIGH_WORD@
}

/* Sine and cosine of a larger x, by the reduction of Payne and Hanek: the bits of 2/pi that contribute to x * 2/pi
 * modulo 4 are multiplied as integers. NaN for infinities and NaN. */
@UPPER@_RARE static void @PREFIX@_far(@NUMBER@ x, @NUMBER@ *restrict sine, @NUMBER@ *restrict cosine)
{
    /* 2/pi as a binary fraction after 64 zero bits. */
    static const uint32_t two_over_pi[40] = {
@TABLE@
    };
    @PREFIX@_view view;
    @UINT@ window[3];
    view.number = x;
    const @UINT@ magnitude = (view.bits << 1) >> 1;
    const int biased = (int)(magnitude >> @STORED@);
    if (biased > @LARGEST@) {
        view.bits = @QUIET_NAN@;
        *sine = view.number;
        *cosine = view.number;
        return;
    }
    /* x = m * 2^e. Bits of 2/pi with a value of 4 * 2^-e or more only add full turns. The window starts after them and is
     * three words long. */
    const @UINT@ one = 1U;
    const @UINT@ m = (magnitude & ((one << @STORED@) - 1U)) | (one << @STORED@);
    const int at = biased - @SHIFT@;
    for (int k = 0; k < 3; k++) {
        window[k] = 0U;
        for (int part = 0; part < @WORDS@; part++) {
            const int word = at / 32 + k * @WORDS@ + part;
            const uint64_t first = word < 40 ? two_over_pi[word] : 0U;
            const uint64_t second = word + 1 < 40 ? two_over_pi[word + 1] : 0U;
            const uint32_t bits = (uint32_t)((((first << 32) | second) << (at % 32)) >> 32);
            window[k] |= (@UINT@)bits << (32 * (@LAST_WORD@ - part));
        }
    }
    const @UINT@ low = m * window[2];
    const @UINT@ carry = @PREFIX@_high(m, window[2]);
    const @UINT@ mid = m * window[1] + carry;
    const @UINT@ high = m * window[0] + @PREFIX@_high(m, window[1]) + (mid < carry ? 1U : 0U);
    /* The first two bits are the quadrant; the rest is the fraction of a quadrant, as a signed number around the
     * nearest. */
    @UINT@ upper = (high << 2) | (mid >> @LOW@);
    @UINT@ lower = (mid << 2) | (low >> @LOW@);
    const @UINT@ negative = upper >> @TOP@;
    if (negative != 0U) {
        lower = ~lower + 1U;
        upper = ~upper + (lower == 0U ? 1U : 0U);
    }
    int zeros = 0;
    while ((upper >> @TOP@) == 0U && zeros < @TOP@) {
        upper = (upper << 1) | (lower >> @TOP@);
        lower <<= 1;
        zeros++;
    }
    /* angle * 2^(-@TOP@ - zeros) radians, split into two numbers exactly. */
    const @UINT@ angle = @PREFIX@_high(upper, @QUARTER_PI@);
    const @UINT@ rest = angle & ((one << @REST@) - 1U);
    view.bits = (@SCALE@U - (@UINT@)zeros) << @STORED@;
    const @NUMBER@ big = (@NUMBER@)(angle - rest) * view.number;
    const @NUMBER@ small = (@NUMBER@)rest * view.number;
    const @NUMBER@ y0 = big + small;
    const @NUMBER@ y1 = (big - y0) + small;
    const @UINT@ quadrant = (high >> @LOW@) + negative;
    @PREFIX@_quadrant(negative != 0U ? -y0 : y0, negative != 0U ? -y1 : y1, quadrant, sine, cosine);
    if (x < @ZERO@) {
        *sine = -*sine;
    }
}
";

/// The same in code for bounded angles.
const NO_NUMBER: &str = "
/* NaN for x beyond that range. */
@UPPER@_RARE static void @PREFIX@_far(@NUMBER@ x, @NUMBER@ *restrict sine, @NUMBER@ *restrict cosine)
{
    @PREFIX@_view view;
    (void)x;
    view.bits = @QUIET_NAN@;
    *sine = view.number;
    *cosine = view.number;
}
";

/// One angle.
const ONE: &str = "
/* Whether x is beyond that range: large, infinite or NaN. The comparison is on the bits, so that NaN counts as large. */
static inline int @PREFIX@_beyond(@NUMBER@ x)
{
    @PREFIX@_view view;
    view.number = x;
    return (view.bits << 1) > (@LIMIT_BITS@ << 1);
}

/* Sine and cosine of x, rad, @DOMAIN@. */
static inline void @PREFIX@_sine_cosine(@NUMBER@ x, @NUMBER@ *restrict sine, @NUMBER@ *restrict cosine)
{
    if (@PREFIX@_beyond(x) != 0) {
        @PREFIX@_far(x, sine, cosine);
    } else {
        @PREFIX@_near(x, sine, cosine);
    }
}
";

/// The same for several angles.
const SEVERAL: &str = "
/* The same for n angles. The first loop has no branches, so that it becomes vector instructions where there are some. */
static inline void @PREFIX@_sines_cosines(
    const @NUMBER@ *restrict x, @NUMBER@ *restrict sines, @NUMBER@ *restrict cosines, int n)
{
    int far = 0;
    for (int k = 0; k < n; k++) {
        @PREFIX@_near(x[k], &sines[k], &cosines[k]);
        far |= @PREFIX@_beyond(x[k]);
    }
    if (far != 0) {
        for (int k = 0; k < n; k++) {
            @NUMBER@ sine;
            @NUMBER@ cosine;
            @PREFIX@_sine_cosine(x[k], &sine, &cosine);
            sines[k] = sine;
            cosines[k] = cosine;
        }
    }
}
";
