//! Plots and pictures as drawings: what is on them, where, and in which colours.

use std::collections::BTreeSet;
use std::path::Path;

use mbd_cli::ink::{self, channels, Inks, COLOURS, DARK, LIGHT};
use mbd_cli::plot::{self, Axis, Panel};

use crate::run::{folder, good, run_in, ROOT};

/// A file of a run of `mbd simulate` on a shipped model.
fn simulated(name: &str, model: &str, more: &[&str]) -> [String; 2] {
    let folder = folder(&format!("drawings_{name}"));
    let model = Path::new(ROOT).join("models").join(model).display().to_string();
    let files = ["--csv", "a.csv", "--svg", "plot.svg", "--picture", "picture.svg"];
    good(run_in(&folder, &[&["simulate", &model], &files[..], more].concat()));
    ["plot.svg", "picture.svg"].map(|file| std::fs::read_to_string(folder.join(file)).expect("a drawing"))
}

fn number(node: &roxmltree::Node, attribute: &str) -> f64 {
    node.attribute(attribute).and_then(|x| x.parse().ok()).unwrap_or(f64::NAN)
}

/// Asserts what holds for every drawing: it is XML of moderate size with both sets of colours and no script, and all of its
/// text is on the page.
#[track_caller]
fn sound(svg: &str) {
    let document = roxmltree::Document::parse(svg).expect("XML");
    let root = document.root_element();
    let (width, height) = (number(&root, "width"), number(&root, "height"));
    assert_eq!(root.attribute("viewBox"), Some(format!("0 0 {width} {height}").as_str()));
    assert!(svg.contains("prefers-color-scheme:dark") && !svg.contains("<script") && !svg.contains("NaN"));
    assert!(svg.len() < 200_000, "{} bytes", svg.len());
    for text in document.descendants().filter(|n| n.has_tag_name("text")) {
        let words: String = text
            .descendants()
            .filter(|n| n.is_text() && !n.parent().is_some_and(|p| p.has_tag_name("title")))
            .filter_map(|n| n.text())
            .collect();
        let class = text.attribute("class").unwrap_or_default();
        // An estimate from below, by the size of the letters.
        let size = text
            .attribute("style")
            .and_then(|s| s.trim_start_matches("font-size:").trim_end_matches("px").parse().ok());
        let long = 0.5 * size.unwrap_or(11.0) * words.chars().count() as f64;
        let [x, y] = ["x", "y"].map(|a| number(&text, a));
        let left = match class {
            c if c.contains("end") => x - long,
            c if c.contains("mid") => x - 0.5 * long,
            _ => x,
        };
        assert!(
            left >= 0.0 && left + long <= width && y >= 10.0 && y <= height - 3.0,
            "{words}: {x} {y} on {width} {height}"
        );
    }
}

/// Classes and places of the curves of a plot; samples of legends are no curves.
fn curves(svg: &str) -> Vec<String> {
    let document = roxmltree::Document::parse(svg).expect("XML");
    let paths = document.descendants().filter(|n| n.has_tag_name("path"));
    let named = paths.filter(|n| n.children().any(|c| c.has_tag_name("title")));
    named.filter_map(|n| n.attribute("class")).map(String::from).collect()
}

#[test]
fn many_joints_get_a_small_chart_each() {
    let [plot, picture] = simulated("g1", "g1.urdf", &["--time", "0.05", "--rows", "20"]);
    sound(&plot);
    sound(&picture);
    assert_eq!(curves(&plot).len(), 29);
    assert_eq!(plot.matches("class=\"axis\"").count(), 29 + usize::from(!plot.contains("The energy")));
    // The head has no joint but a weld, and its mass 0.45 m above it: it is as large as a head, and no stick.
    let document = roxmltree::Document::parse(&picture).expect("XML");
    let scale = document.descendants().find(|n| n.text().is_some_and(|t| t.ends_with(" m"))).expect("a scale");
    let metres: f64 = scale.text().and_then(|t| t.trim_end_matches(" m").parse().ok()).expect("a number");
    let bar = document.descendants().filter_map(|n| n.attribute("d")).find(|d| d.contains("v8m0 -4H")).expect("a bar");
    let ends: Vec<f64> =
        bar.split(|c: char| c.is_ascii_alphabetic() || c == ' ').filter_map(|x| x.parse().ok()).collect();
    let pixels = (ends[5] - ends[0]) / metres;
    let long = |d: &str| {
        let y: Vec<f64> = d.split(['M', 'L', 'Z']).filter_map(|p| p.split_once(' ')?.1.parse().ok()).collect();
        y.iter().copied().fold(f64::MIN, f64::max) - y.iter().copied().fold(f64::MAX, f64::min)
    };
    let bodies = document.descendants().filter(|n| n.attribute("class").is_some_and(|c| c.contains("round")));
    let longest = bodies.filter_map(|n| n.attribute("d")).map(long).fold(0.0, f64::max);
    assert!(longest < 0.45 * pixels, "a body of {} m", longest / pixels);
}

#[test]
fn few_curves_share_a_chart_and_differ() {
    let [plot, picture] = simulated("ur5", "ur5.urdf", &["--time", "0.5", "--rows", "50"]);
    sound(&plot);
    sound(&picture);
    let all = curves(&plot);
    assert_eq!(all.len(), 6);
    assert_eq!(all.iter().collect::<BTreeSet<_>>().len(), 6, "{all:?}");
    assert!(picture.contains(">forearm_link</text>") && picture.contains(">g</text>"));
}

#[test]
fn curves_on_one_another_are_dashed_and_gaps_stay() {
    let t: Vec<f64> = (0..100).map(f64::from).collect();
    let wave: Vec<f64> = t.iter().map(|t| (0.1 * t).sin()).collect();
    let mut broken = wave.clone();
    broken[50] = f64::NAN;
    let lines = vec![("a".into(), wave.clone()), ("b".into(), wave), ("c & <d>".into(), broken)];
    let svg = plot::svg("Twins", &[Panel::new("angle [rad]", t, lines)]);
    sound(&svg);
    assert_eq!(curves(&svg), ["curve c0", "curve c1 d1", "curve c2 d2"]);
}

#[test]
fn nothing_to_draw_is_no_error() {
    let empty = Panel::new("angle [rad]", Vec::new(), vec![("a".into(), Vec::new())]);
    let one = Panel::new("angle [rad]", vec![0.0], vec![("a".into(), vec![1.0]), ("b".into(), vec![f64::NAN])]);
    let many = (0..200).map(|k| (format!("joint {k}"), vec![f64::INFINITY; 2])).collect();
    let many = Panel::new("angle [rad]", vec![0.0, f64::NAN], many).apart();
    let lines =
        (0..40).map(|k| (format!("a name that is much too long for its place {k}"), vec![0.0, 1e300])).collect();
    let words = Panel::new("energy", Vec::new(), Vec::new()).in_words("It is constant.".into());
    sound(&plot::svg(&"long ".repeat(80), &[empty, one, many, Panel::new("x", vec![0.0, 1.0], lines), words]));
    sound(&plot::svg("", &[]));
}

#[test]
fn the_legs_of_the_stewart_platform_have_no_gap() {
    let [plot, picture] = simulated("stewart", "mechanisms/stewart.toml", &["--time", "0.5", "--strobes", "1"]);
    sound(&plot);
    sound(&picture);
    // Bars: two ends and a width. Both halves of a leg have one colour.
    let document = roxmltree::Document::parse(&picture).expect("XML");
    let mut legs = vec![Vec::new(); COLOURS];
    for node in document.descendants().filter(|n| n.attribute("class").is_some_and(|c| c.starts_with("round n c"))) {
        let d = node.attribute("d").unwrap_or_default();
        let ends: Vec<f64> = d.split(['M', 'L', ' ']).filter_map(|x| x.parse().ok()).collect();
        let colour: usize = node.attribute("class").and_then(|c| c[9..].parse().ok()).expect("a colour");
        if let [a, b, c, d] = ends[..] {
            legs[colour].push([a.hypot(0.0), b, c, d]);
        }
    }
    let mut met = 0;
    for bars in legs.iter().filter(|bars| bars.len() > 1) {
        met += 1;
        // From the lowest to the highest end, every height is on a bar.
        let mut spans: Vec<[f64; 2]> = bars.iter().map(|b| [b[1].min(b[3]), b[1].max(b[3])]).collect();
        spans.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let mut reached = spans[0][1];
        for span in spans {
            assert!(span[0] <= reached + 1.0, "a gap of {} pixels", span[0] - reached);
            reached = reached.max(span[1]);
        }
    }
    assert_eq!(met, 6);
}

#[test]
fn moving_pictures_loop_without_a_script() {
    let arguments = ["--time", "0.3", "--v", "15,0,0,0,0,0,0", "--trace", "toe", "--animate", "--names", "none"];
    let [_, picture] = simulated("moving", "mechanisms/strandbeest_leg.toml", &arguments);
    sound(&picture);
    let document = roxmltree::Document::parse(&picture).expect("XML");
    let moves: Vec<_> = document.descendants().filter(|n| n.has_tag_name("animate")).collect();
    assert!(moves.len() > 10);
    let counts: BTreeSet<usize> =
        moves.iter().map(|n| n.attribute("values").unwrap_or_default().split(';').count()).collect();
    assert_eq!(counts.len(), 1, "one number of instants: {counts:?}");
    assert!(moves.iter().all(|n| n.attribute("repeatCount") == Some("indefinite")));
    assert!(picture.contains("prefers-reduced-motion:reduce") && picture.contains("times slower"));
    assert!(!picture.contains(">foot</text>"), "a name");
    let again = simulated("moving_again", "mechanisms/strandbeest_leg.toml", &arguments);
    assert!(again[1] == picture, "the same bytes");
}

#[test]
fn axes_have_marks_at_steps_of_one_two_or_five() {
    let numbers = |axis: &Axis| axis.marks().into_iter().map(|(_, number)| number).collect::<Vec<_>>();
    assert_eq!(numbers(&Axis::linear([0.0, 10.0], 6.0)), ["0", "2", "4", "6", "8", "10"]);
    assert_eq!(numbers(&Axis::linear([-0.31, 0.12], 5.0)), ["−0.3", "−0.2", "−0.1", "0", "0.1"]);
    assert_eq!(numbers(&Axis::linear([1.20, 1.26], 4.0)), ["1.20", "1.22", "1.24", "1.26"]);
    assert_eq!(numbers(&Axis::linear([0.0, 3e-9], 4.0)), ["0", "1·10⁻⁹", "2·10⁻⁹", "3·10⁻⁹"]);
    let axis = Axis::logarithmic([3e-5, 0.2].into_iter(), 9.0);
    assert_eq!(numbers(&axis), ["10⁻⁵", "10⁻⁴", "10⁻³", "10⁻²", "10⁻¹", "1"]);
    for range in [[0.0, 0.0], [5.0, 5.0], [-1e-300, 1e-300], [1e308, 1e308], [0.0, 1e-320], [1.0, 1.0 + 1e-15]] {
        let axis = Axis::airy(range, 4.0);
        assert!(axis.place(range[0]).is_finite(), "{axis:?}");
        axis.marks();
    }
}

fn linear(colour: &str) -> [f64; 3] {
    channels(colour).map(|x| x / 255.0).map(|x| if x <= 0.040_45 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) })
}

fn apply(m: &[[f64; 3]; 3], x: [f64; 3]) -> [f64; 3] {
    m.map(|row| row[0] * x[0] + row[1] * x[1] + row[2] * x[2])
}

/// Contrast of two colours as the Web Content Accessibility Guidelines define it.
fn contrast(a: &str, b: &str) -> f64 {
    let light = |c: &str| apply(&[[0.2126, 0.7152, 0.0722]; 3], linear(c))[0] + 0.05;
    let (a, b) = (light(a), light(b));
    (a / b).max(b / a)
}

/// Coordinates in Ottosson's uniform colour space.
fn uniform(linear: [f64; 3]) -> [f64; 3] {
    let first = [
        [0.412_221_470_8, 0.536_332_536_3, 0.051_445_992_9],
        [0.211_903_498_2, 0.680_699_545_1, 0.107_396_956_6],
        [0.088_302_461_9, 0.281_718_837_6, 0.629_978_700_5],
    ];
    let second = [
        [0.210_454_255_3, 0.793_617_785, -0.004_072_046_8],
        [1.977_998_495_1, -2.428_592_205, 0.450_593_709_9],
        [0.025_904_037_1, 0.782_771_766_2, -0.808_675_766],
    ];
    apply(&second, apply(&first, linear).map(|x| x.max(0.0).cbrt()))
}

/// Who lacks the red or the green cones sees all pairs of lines apart, by the matrices of Machado and others (2009).
#[test]
fn colours_are_legible_and_distinct_for_the_colour_blind() {
    let normal = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let red =
        [[0.152_286, 1.052_583, -0.204_868], [0.114_503, 0.786_281, 0.099_216], [-0.003_882, -0.048_116, 1.051_998]];
    let green =
        [[0.367_322, 0.860_646, -0.227_968], [0.280_085, 0.672_501, 0.047_413], [-0.011_82, 0.042_94, 0.968_881]];
    for Inks { lines, paper, text, muted, force, .. } in [LIGHT, DARK] {
        for line in lines.iter().chain([&force]) {
            assert!(contrast(line, paper) >= 3.0, "{line} on {paper}: {}", contrast(line, paper));
        }
        assert!(contrast(text, paper) >= 7.0 && contrast(muted, paper) >= 4.5);
        for sight in [normal, red, green] {
            let seen = lines.map(|c| uniform(apply(&sight, linear(c)).map(|x| x.clamp(0.0, 1.0))));
            for (i, a) in seen.iter().enumerate() {
                for (k, b) in seen[..i].iter().enumerate() {
                    let distance = (0..3).fold(0.0_f64, |n, c| n.hypot(a[c] - b[c]));
                    assert!(distance > 0.1, "{} and {} are {distance} apart", lines[i], lines[k]);
                }
            }
        }
    }
    let classes: BTreeSet<String> = (0..COLOURS * ink::DASHES).map(|k| ink::line_class(k, 0)).collect();
    assert_eq!(classes.len(), COLOURS * ink::DASHES);
}
