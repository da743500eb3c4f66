//! `hlod-build INPUT... OUT`: arguments in, exit code out.

mod build;
mod cells;
mod terminal;
mod verify;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use build::{BuildArgs, MergeArgs};
use cells::CellsArgs;
use clap::{Parser, Subcommand};
use hlod::Result;
use hlod::format::Scene;
use hlod::report::inspect;
use terminal::print;
use verify::VerifyArgs;

/// Turns city meshes into a hierarchy of levels of detail.
///
/// Reads OBJ, glTF and GLB files, or folders of them; divides all of them together into blocks; and
/// writes for every block a tree of nodes, coarse at the root, the original triangles at the leaves,
/// and nodes above the blocks. Writes OUT/scene.hlod (index), OUT/nodes/*.glb, OUT/tileset.json
/// (3D Tiles) and OUT/build.json (report).
/// An earlier result in OUT stays until the new one is complete. Where inputs and options have not
/// changed, nothing is done.
#[derive(Parser, Debug)]
#[command(
    version,
    args_conflicts_with_subcommands = true,
    subcommand_negates_reqs = true,
    override_usage = "hlod-build [OPTIONS] INPUT... OUT\n       hlod-build inspect [--json] OUT\n       hlod-build verify [--json] [--source MODEL]... OUT\n       hlod-build cells [OPTIONS] OUT\n       hlod-build merge OUT",
    after_help = "Examples:\n  hlod-build city.obj out/\n  hlod-build --blocks grid:200 tiles/ more.glb out/\n  hlod-build inspect out/\n  hlod-build verify out/ --source city.obj\n  hlod-build cells out/ --along walk.csv\n\nExit codes: 0 success, 1 internal error, 2 usage, 3 input missing or invalid, or what verify looked at does not hold, 4 output not written, 5 no graphics adapter (cells)."
)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    build: BuildArgs,
}

#[derive(Subcommand, Debug)]
enum Command {
    /// Prints a built hierarchy: for people, or with --json for programs
    Inspect {
        /// The output folder of an earlier build
        out: PathBuf,
        /// One JSON object with `nodes` and all their attributes
        #[arg(long)]
        json: bool,
        /// Show at most N blocks' trees
        #[arg(long, value_name = "N", default_value_t = 20)]
        blocks: usize,
    },
    /// Checks a built hierarchy against its source: files, attributes, distances, gaps, colours.
    /// Ends in pass or, with exit code 3, in fail
    Verify(VerifyArgs),
    /// Prepares cells where viewers are: what is far from each is drawn from textured depth meshes
    /// (`hlod-bench --far-field cells`). Writes OUT/cells.hlod (index) and OUT/cells/*.glb; goes on where an
    /// earlier run was stopped. Needs a graphics adapter, or Mesa's lavapipe (Debian: mesa-vulkan-drivers)
    Cells(CellsArgs),
    /// Joins what machines built of one city with --subset: the same files as one build
    Merge(MergeArgs),
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    let done = match cli.command {
        Some(Command::Inspect { out, json, blocks }) => {
            inspect_scene(&out, json, blocks).map(|()| ExitCode::SUCCESS)
        }
        Some(Command::Verify(arguments)) => verify::verify_scene(&arguments),
        Some(Command::Cells(arguments)) => cells::cells(&arguments).map(|()| ExitCode::SUCCESS),
        Some(Command::Merge(arguments)) => build::merge(&arguments).map(|()| ExitCode::SUCCESS),
        None => build::run(&cli.build).map(|()| ExitCode::SUCCESS),
    };
    match done {
        Ok(code) => code,
        Err(error) => {
            eprintln!("hlod-build: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}

fn inspect_scene(out: &Path, json: bool, blocks: usize) -> Result<()> {
    let scene = Scene::read(out)?;
    print(&if json {
        format!("{:#}\n", inspect::json(&scene))
    } else {
        inspect::text(&scene, blocks)
    })
}
