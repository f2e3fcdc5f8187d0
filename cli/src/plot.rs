//! Plots as SVG text.

use plotters::coord::Shift;
use plotters::prelude::*;

/// One panel: lines over time, or over another quantity that starts at zero.
pub struct Panel {
    /// Label of the vertical axis, with the unit.
    pub label: String,
    /// Times, s.
    pub t: Vec<f64>,
    /// Name (empty: not in the legend) and values; values that are not finite are left out.
    pub lines: Vec<(String, Vec<f64>)>,
}

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// Factor by which the plot is drawn larger than it is shown. The backend rounds to whole units; the factor keeps lines
/// smooth.
pub const SCALE: u32 = 3;
const WIDTH: u32 = 1100 * SCALE;
/// Width of the legend, pixels.
const LEGEND: u32 = 210 * SCALE;
const TITLE: u32 = 36 * SCALE;
/// Largest number of points of one line; more points enlarge the file without a visible difference.
const POINTS: usize = 600;
/// Largest number of entries of a legend; more colours cannot be distinguished.
const ENTRIES: usize = 40;
const ROW: u32 = 14 * SCALE;

/// Panels below each other over the same time.
pub fn svg(title: &str, panels: &[Panel]) -> Result<String, String> {
    svg_over(title, "time [s]", panels)
}

/// Panels below each other over the same quantity, whose label is `x`.
pub fn svg_over(title: &str, x: &str, panels: &[Panel]) -> Result<String, String> {
    let heights: Vec<u32> = panels.iter().enumerate().map(|(k, p)| height(p, k + 1 == panels.len())).collect();
    let mut text = String::new();
    {
        let size = (WIDTH, TITLE + heights.iter().sum::<u32>());
        let root = SVGBackend::with_string(&mut text, size).into_drawing_area();
        let drawn = draw(&root, title, x, panels, &heights);
        drawn.and_then(|()| root.present()).map_err(|e| e.to_string())?;
    }
    Ok(shrunk(&text))
}

/// Sets the size at which the picture is shown; the `viewBox` keeps the units of the drawing.
pub fn shrunk(text: &str) -> String {
    let number = |key: &str| {
        let value = text.split(key).nth(1).and_then(|rest| rest.split('"').next());
        value.and_then(|v| v.parse::<u32>().ok()).map(|v| (format!("{key}{v}\""), format!("{key}{}\"", v / SCALE)))
    };
    [" width=\"", " height=\""].into_iter().filter_map(number).fold(text.to_string(), |t, (a, b)| t.replacen(&a, &b, 1))
}

fn height(panel: &Panel, last: bool) -> u32 {
    let entries = panel.lines.iter().filter(|l| !l.0.is_empty()).count();
    let legend = ROW * (entries.min(ENTRIES + 1) as u32) + 40 * SCALE;
    legend.max(SCALE * if last { 230 } else { 300 })
}

fn draw(
    root: &Area,
    title: &str,
    x: &str,
    panels: &[Panel],
    heights: &[u32],
) -> Result<(), DrawingAreaErrorKind<std::io::Error>> {
    root.fill(&WHITE)?;
    let style = ("sans-serif", 18 * SCALE).into_font().color(&BLACK);
    root.draw(&Text::new(title.to_string(), (16 * SCALE as i32, 12 * SCALE as i32), style))?;
    let mut rest = root.split_vertically(TITLE).1;
    for (panel, &height) in panels.iter().zip(heights) {
        let (here, below) = rest.split_vertically(height);
        rest = below;
        let (chart, legend) = here.split_horizontally(WIDTH - LEGEND);
        draw_chart(&chart, x, panel)?;
        draw_legend(&legend, panel)?;
    }
    Ok(())
}

/// Colours in the order of the lines. They are far apart, and their lightness alternates, so that neighbours also
/// differ in print.
pub fn colour(k: usize) -> HSLColor {
    let hue = (0.61 + k as f64 * 0.381_966) % 1.0;
    HSLColor(hue, 0.75, [0.42, 0.3, 0.55][k % 3])
}

fn draw_chart(area: &Area, x: &str, panel: &Panel) -> Result<(), DrawingAreaErrorKind<std::io::Error>> {
    let end = panel.t.last().copied().unwrap_or(1.0);
    let all = panel.lines.iter().flat_map(|l| &l.1).copied();
    let (low, high) = all.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
    // A constant needs a range too.
    let pad = ((high - low) * 0.05).max(low.abs().max(high.abs()) * 1e-3).max(1e-18);
    let mut chart = ChartBuilder::on(area)
        .margin(8 * SCALE)
        .x_label_area_size(38 * SCALE)
        .y_label_area_size(78 * SCALE)
        .build_cartesian_2d(0.0..end, low - pad..high + pad)?;
    let step = tick(high - low + 2.0 * pad, 6);
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(RGBColor(222, 222, 222).stroke_width(SCALE))
        .axis_style(RGBColor(90, 90, 90).stroke_width(SCALE))
        .set_all_tick_mark_size(4 * SCALE)
        .x_desc(x)
        .y_desc(panel.label.as_str())
        .x_labels(11)
        .y_labels(6)
        .x_label_formatter(&|t| number(*t, tick(end, 11)))
        .y_label_formatter(&|y| number(*y, step))
        .label_style(("sans-serif", 12 * SCALE))
        .axis_desc_style(("sans-serif", 13 * SCALE))
        .draw()?;
    let stride = panel.t.len().div_ceil(POINTS).max(1);
    for (k, (_, values)) in panel.lines.iter().enumerate() {
        let last = panel.t.len().saturating_sub(1);
        let points = panel.t.iter().copied().zip(values.iter().copied()).enumerate();
        let points =
            points.filter(|(i, (_, y))| (i % stride == 0 || *i == last) && y.is_finite()).map(|(_, point)| point);
        chart.draw_series(LineSeries::new(points, colour(k).stroke_width(SCALE)))?;
    }
    Ok(())
}

fn draw_legend(area: &Area, panel: &Panel) -> Result<(), DrawingAreaErrorKind<std::io::Error>> {
    let named: Vec<(usize, &str)> =
        panel.lines.iter().enumerate().map(|(k, l)| (k, l.0.as_str())).filter(|(_, n)| !n.is_empty()).collect();
    let style = ("sans-serif", 11 * SCALE).into_font().color(&BLACK);
    let unit = SCALE as i32;
    let row = |k: usize| 14 * unit + (k as u32 * ROW) as i32;
    for (place, (k, name)) in named.iter().take(ENTRIES).enumerate() {
        let y = row(place);
        area.draw(&PathElement::new([(4 * unit, y), (22 * unit, y)], colour(*k).stroke_width(2 * SCALE)))?;
        area.draw(&Text::new(shortened(name), (28 * unit, y - 6 * unit), style.clone()))?;
    }
    if named.len() > ENTRIES {
        let rest = format!("and {} more", named.len() - ENTRIES);
        area.draw(&Text::new(rest, (28 * unit, row(ENTRIES) - 6 * unit), style))?;
    }
    Ok(())
}

/// A name shortened to fit: the middle is left out, because the end is more informative.
fn shortened(name: &str) -> String {
    const LONGEST: usize = 28;
    let letters: Vec<char> = name.chars().map(|c| if c.is_control() { '?' } else { c }).collect();
    if letters.len() <= LONGEST {
        return letters.into_iter().collect();
    }
    let (head, tail) = (&letters[..LONGEST / 2 - 1], &letters[letters.len() - LONGEST / 2..]);
    head.iter().chain(&['…']).chain(tail).collect()
}

/// Distance between marks, for about `n` marks on a range.
fn tick(range: f64, n: u32) -> f64 {
    10.0_f64.powf((range / f64::from(n)).log10().floor())
}

/// The number at a mark, with enough digits to distinguish it from the next.
fn number(x: f64, step: f64) -> String {
    let x = if x.abs() < 0.5 * step { 0.0 } else { x };
    let digits = (-step.log10().floor()).max(0.0) as usize;
    match x == 0.0 || (1e-3..1e5).contains(&step.max(x.abs())) && digits <= 4 {
        true if x == 0.0 => "0".to_string(),
        true => format!("{x:.digits$}"),
        false => format!("{x:.1e}"),
    }
}
