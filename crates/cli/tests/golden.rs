//! What the program prints, word for word.
//!
//! The cases are `tests/golden/*.trycmd`: commands, each with what it prints. A folder `NAME.in` beside `NAME.trycmd`
//! is where its commands run; the others run in the folder of this crate. After a change that is meant, write the new
//! output into the cases by
//!
//! ```sh
//! TRYCMD=overwrite cargo test -p jointscope-cli --test golden
//! ```
//!
//! and read the difference before committing it.

#[test]
fn the_program_prints_what_the_golden_files_say() {
    trycmd::TestCases::new()
        .case("tests/golden/*.trycmd")
        // Whatever the terminal and the environment of who runs the tests.
        .env("COLUMNS", "100")
        .env("NO_COLOR", "1")
        .env("FORCE_COLOR", "0")
        .env("CLICOLOR_FORCE", "0")
        .env("NO_GRAPHICS", "0")
        .insert_var("[VERSION]", env!("CARGO_PKG_VERSION"))
        .expect("a name in brackets");
}
