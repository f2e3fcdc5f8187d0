//! `native FOLDER MODELS...` writes the code of every model into a folder.

use mbd_codegen::read::read_bytes;

fn main() -> std::io::Result<()> {
    let mut arguments = std::env::args().skip(1);
    let folder = arguments.next().expect("native FOLDER MODELS...");
    for path in arguments {
        let code = host::code(&path, &std::fs::read_to_string(&path)?, &read_bytes);
        std::fs::write(format!("{folder}/{}.rs", path.replace('/', "_")), code)?;
    }
    Ok(())
}
