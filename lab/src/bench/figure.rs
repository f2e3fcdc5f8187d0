//! Figures with logarithmic axes.

use plotters::coord::Shift;
use plotters::prelude::*;

use mbd_cli::plot::{colour, shrunk, SCALE};

/// One line: points `(x, y)`, both positive.
pub struct Line {
    /// Name in the legend.
    pub name: String,
    /// Points, in order.
    pub points: Vec<(f64, f64)>,
    /// Whether the line is dashed and without marks, as lines for comparison are.
    pub thin: bool,
}

/// Two charts side by side with one legend.
pub struct Figure {
    /// Title over both charts.
    pub title: String,
    /// Label of the horizontal axes.
    pub x: [String; 2],
    /// Labels of the vertical axes.
    pub y: [String; 2],
    /// Lines of both charts, in the same order.
    pub lines: [Vec<Line>; 2],
}

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Drawn = Result<(), DrawingAreaErrorKind<std::io::Error>>;

const WIDTH: u32 = 1180 * SCALE;
const HEIGHT: u32 = 440 * SCALE;
const LEGEND: u32 = 230 * SCALE;
const TITLE: u32 = 32 * SCALE;

impl Figure {
    /// The figure as SVG.
    pub fn svg(&self) -> Result<String, String> {
        let mut text = String::new();
        {
            let root = SVGBackend::with_string(&mut text, (WIDTH, HEIGHT)).into_drawing_area();
            self.draw(&root).and_then(|()| root.present()).map_err(|e| e.to_string())?;
        }
        Ok(shrunk(&text))
    }

    fn draw(&self, root: &Area) -> Drawn {
        root.fill(&WHITE)?;
        let style = ("sans-serif", 17 * SCALE).into_font().color(&BLACK);
        root.draw(&Text::new(self.title.clone(), (16 * SCALE as i32, 10 * SCALE as i32), style))?;
        let (charts, legend) = root.split_vertically(TITLE).1.split_horizontally(WIDTH - LEGEND);
        let (left, right) = charts.split_horizontally((WIDTH - LEGEND) / 2);
        for (k, area) in [left, right].iter().enumerate() {
            chart(area, &self.x[k], &self.y[k], &self.lines[k])?;
        }
        let style = ("sans-serif", 11 * SCALE).into_font().color(&BLACK);
        let unit = SCALE as i32;
        for (k, line) in self.lines[0].iter().enumerate() {
            let y = 24 * unit + (k as i32) * 16 * unit;
            let stroke = colour(k).stroke_width(2 * SCALE);
            if line.thin {
                for from in [4, 15] {
                    legend.draw(&PathElement::new([(from * unit, y), ((from + 8) * unit, y)], stroke))?;
                }
            } else {
                legend.draw(&PathElement::new([(4 * unit, y), (26 * unit, y)], stroke))?;
                legend.draw(&Circle::new((15 * unit, y), 3 * unit, colour(k).filled()))?;
            }
            legend.draw(&Text::new(line.name.clone(), (32 * unit, y - 6 * unit), style.clone()))?;
        }
        Ok(())
    }
}

/// The range of all values, extended to whole powers of ten.
fn range(values: impl Iterator<Item = f64>) -> std::ops::Range<f64> {
    let logs = values.filter(|x| *x > 0.0 && x.is_finite()).map(f64::log10);
    let (low, high) = logs.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
    match low <= high {
        true => 10.0_f64.powf(low.floor())..10.0_f64.powf((high + 1e-9).ceil().max(low.floor() + 1.0)),
        false => 0.1..1.0,
    }
}

fn chart(area: &Area, x: &str, y: &str, lines: &[Line]) -> Drawn {
    let all = || lines.iter().flat_map(|l| &l.points);
    let (xs, ys) = (range(all().map(|p| p.0)), range(all().map(|p| p.1)));
    let mut chart = ChartBuilder::on(area)
        .margin(8 * SCALE)
        .x_label_area_size(38 * SCALE)
        .y_label_area_size(66 * SCALE)
        .build_cartesian_2d(xs.log_scale(), ys.log_scale())?;
    let power = |v: &f64| match v.log10().round() {
        0.0 => "1".to_string(),
        power => format!("1e{power}"),
    };
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(RGBColor(224, 224, 224).stroke_width(SCALE))
        .axis_style(RGBColor(90, 90, 90).stroke_width(SCALE))
        .x_desc(x)
        .y_desc(y)
        .x_labels(9)
        .y_labels(9)
        .x_label_formatter(&power)
        .y_label_formatter(&power)
        .label_style(("sans-serif", 11 * SCALE))
        .axis_desc_style(("sans-serif", 13 * SCALE))
        .draw()?;
    for (k, line) in lines.iter().enumerate() {
        let points = line.points.iter().copied();
        if line.thin {
            let style = colour(k).stroke_width(2 * SCALE);
            chart.draw_series(DashedLineSeries::new(points, 6 * SCALE, 4 * SCALE, style))?;
        } else {
            chart.draw_series(LineSeries::new(points, colour(k).stroke_width(2 * SCALE)))?;
            let mark = |p: &(f64, f64)| Circle::new(*p, 3 * SCALE, colour(k).filled());
            chart.draw_series(line.points.iter().map(mark))?;
        }
    }
    Ok(())
}
