//! The jointscope program with one more joint model.

use jointscope_tests as _;

fn main() -> std::process::ExitCode {
    jointscope_cli::main()
}
