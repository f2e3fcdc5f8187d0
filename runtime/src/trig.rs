//! Sine and cosine.
/// placeholder
pub fn sincos_f64(x: f64) -> (f64, f64) {
    (libm::sin(x), libm::cos(x))
}
/// placeholder
pub fn sincos_f32(x: f32) -> (f32, f32) {
    (libm::sinf(x), libm::cosf(x))
}
