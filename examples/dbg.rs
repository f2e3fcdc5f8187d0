use multibody::codegen::import::*;
use multibody::codegen::*;
fn main() {
    let f = std::env::args().nth(1).unwrap();
    let t = std::fs::read_to_string(&f).unwrap();
    let base = match std::env::args().nth(2).as_deref() {
        Some("floating") => Base::Floating,
        _ => Base::Fixed,
    };
    let (m, d) = load(&f, &t, &ImportOptions { base, gravity: std::env::args().nth(3).map(|_| [0.0; 3]) });
    eprintln!("{d}");
    let o = Options { efforts: false, outputs: Group::ALL.to_vec(), ..Options::default() };
    let g = generate(&m.unwrap(), &o).unwrap();
    println!("{}", g.source);
    for (g, c) in g.counts {
        eprintln!("{:?} {:?} total {}", g, c, c.total());
    }
    for n in g.notices {
        eprintln!("{n}");
    }
}
