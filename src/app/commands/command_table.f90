!> The table of commands. A new command is a row here and a module with its procedure.
module nocdyn_command_table
  use nocdyn_analysis_command, only: analysis_command
  use nocdyn_commands, only: add_command, command_t, passed_on
  use nocdyn_companion_command, only: companion_command
  use nocdyn_new_command, only: new_command
  use nocdyn_python_command, only: python_command
  use nocdyn_run_command, only: run_command
  implicit none (type, external)
  private

  public :: list_commands

  character(len=*), parameter :: nl = new_line('a')
  character(len=*), parameter :: variant_help = &
    '  --variant DIR:NUMBER  the machine of a variant of the sweep in DIR; FILE may be left out'
  character(len=*), parameter :: case_help = &
    '  --case NAME        look at this &load_case only; default: all of them, each to DIR/NAME' // nl // variant_help

contains

  !> All commands, as nocdyn runs them: it leaves sweeps to a companion program.
  subroutine list_commands(commands)
    type(command_t), allocatable, intent(out) :: commands(:)

    call list_analyses(commands)
    call list_torsional_analyses(commands)
    call add_command(commands, 'matrices', 'FILE', '--code --set --case --variant', &
      'print the matrices of the method for a machine', &
      'Prints every matrix and vector of the method for the machine at its start, with its equation number.' // nl // nl // &
      '  --code             print the equations of motion as a program in C instead, to be built into others' // nl // &
      '  --case NAME        look at the machine of this &load_case' // nl // variant_help, analysis_command)
    call list_sweeps(commands)
    call list_python_commands(commands)
    call add_command(commands, 'new', 'FILE', '--kind', 'write a commented input to start from', &
      'Writes a commented input file that runs. A file that exists is not overwritten.' // nl // nl // &
      '  --kind KIND        of a machine: car, compressor, genset, mill, motor_fan, ship, wind; default: two bodies' // nl // &
      '                     with the groups that most inputs have', new_command)
    call add_command(commands, 'help', '[COMMAND]', '--json', 'help on a command', &
      'Without a COMMAND, all commands with one line each.' // nl // nl // &
      '  nocdyn help input          the groups of an input file by topics, one line each' // nl // &
      '  nocdyn help input TOPIC    the groups of a topic with their keys and examples' // nl // &
      '  nocdyn help input GROUP    one group with its keys and examples' // nl // &
      '  nocdyn help input all      all groups with their keys, and an example' // nl // &
      '  nocdyn help input --json   the same for programs: a JSON Schema')
  end subroutine list_commands

  subroutine list_analyses(commands)
    type(command_t), allocatable, intent(inout) :: commands(:)

    call add_command(commands, 'run', 'FILE...', '--out --set --case --variant --strict --quiet', &
      'integrate machines and write their results', &
      'Integrates every input file and writes trajectory.csv (or trajectory.nc), summary.json and input.nml.' // nl // nl // &
      '  --out DIR          write to DIR, with several files to DIR/<name of the file>;' // nl // &
      '                     default: &output directory, else results/<name of the file>' // nl // &
      '  --set PATH=VALUE   override a key: run.rtol=1e-9, load.work.viscous=80, gear.reducer.radii=2,3' // nl // &
      '  --case NAME        run only this &load_case; default: all of them, each to DIR/NAME' // nl // &
      variant_help // ', results' // nl // &
      '                     are in DIR/variant-NUMBER then' // nl // &
      '  --strict           exit code 1 if a limit is exceeded' // nl // &
      '  --quiet            print nothing but errors' // nl // nl // &
      'A file with errors does not stop the others; the exit code is the highest of all files. After Ctrl-C or a' // nl // &
      'failed computation, the rows up to there are in trajectory.partial.csv.', run_command)
    call add_command(commands, 'check', 'FILE...', '--out --set --case --variant', 'read and analyse, integrate nothing', &
      'Reads the files and analyses the machines. Prints every error with its line, or the degrees of freedom,' // nl // &
      'independent coordinates, ratios between geared bodies, redundant gears, and the load cases and the sweep if' // nl // &
      'there are some.' // nl // nl // &
      '  --out DIR          write check.json to DIR, with several files to DIR/<name of the file>: inertias,' // nl // &
      '                     ratios, stiffnesses; and mass_elastic.csv, a sheet that nocdyn import reads' // nl // &
      '  --case NAME        look at the machine of this &load_case, and write to its folder in DIR' // nl // variant_help, &
      analysis_command)
    call add_command(commands, 'equilibrium', 'FILE...', '--out --set --case --variant', &
      'steady states: speeds, torques, twists, powers, stability', &
      'Finds the steady states of the machines: constant speeds at which the mean torques balance, and the' // nl // &
      'twists of the couplings that transmit them. If there are several steady states, all are printed with' // nl // &
      'their stability. Excitations enter with their mean.' // nl // nl // &
      '  --out DIR          write equilibrium.json to DIR, with several files to DIR/<name of the file>' // nl // &
      case_help // nl // nl // &
      'Exit code 1: there is no steady state.', analysis_command)
    call add_command(commands, 'modes', 'FILE...', '--out --set --case --variant --at --modes --range_hz --holzer', &
      'natural frequencies, damping, shapes and energies of the modes', &
      'Linearises the machines and prints natural frequencies, damping ratios, time constants and the' // nl // &
      'distribution of the energy of each mode.' // nl // nl // &
      '  --at equilibrium   about the steady state (default); of several, the stable one nearest to the start' // nl // &
      '  --at rest          at the start angles, with zero speeds and mean torques' // nl // &
      '  --at TIME          at a time of the run [s], which is integrated up to there' // nl // &
      '  --modes NUMBER     only so many oscillating modes, of the lowest frequencies; default: all, of a machine' // nl // &
      '                     with more than 1000 degrees of freedom 100' // nl // &
      '  --range_hz LOW,HIGH  only the oscillating modes in this range of frequencies [Hz]' // nl // &
      '  --holzer           print the table of Holzer of each undamped mode; with --out, write holzer.csv' // nl // &
      '  --out DIR          write modes.csv and modes.json to DIR, with several files to DIR/<name of the file>' // nl // &
      case_help, analysis_command)
  end subroutine list_analyses

  subroutine list_torsional_analyses(commands)
    type(command_t), allocatable, intent(inout) :: commands(:)

    call add_command(commands, 'response', 'FILE...', '--out --set --case --variant --strict --quiet', &
      'forced response by orders over a range of speeds, critical speeds, limits', &
      'Computes by &response what the orders of the excitations do at every speed: the steady state at the speed,' // nl // &
      'which the motors hold, and the oscillations about it, of each order and of all together. Prints the' // nl // &
      'critical speeds, the largest moments and the speeds that &limit bars, and writes response.csv,' // nl // &
      'response_orders.csv and response.json.' // nl // nl // &
      '  --out DIR          write to DIR, with several files to DIR/<name of the file>;' // nl // &
      '                     default: &output directory, else results/<name of the file>' // nl // &
      '  --set PATH=VALUE   override a key: response.count=501' // nl // &
      case_help // nl // &
      '  --strict           exit code 1 if a limit is exceeded' // nl // &
      '  --quiet            print nothing but errors' // nl // nl // &
      'The verdict on the limits comes first, the worst line at its head; response.json has it too.', analysis_command)
    call add_command(commands, 'campbell', 'FILE...', '--out --set --case --variant --quiet --modes --range_hz', &
      'natural frequencies over a range of speeds, and where the orders meet them', &
      'Follows the natural frequencies of the machine, linearised about its steady states, over the speeds of' // nl // &
      '&response, and finds the speeds at which its orders, or those of the excitations, meet them. Writes' // nl // &
      'campbell.csv and campbell.json.' // nl // nl // &
      '  --out DIR          write to DIR, with several files to DIR/<name of the file>;' // nl // &
      '                     default: &output directory, else results/<name of the file>' // nl // &
      '  --set PATH=VALUE   override a key: response.count=501' // nl // &
      case_help // nl // &
      '  --modes NUMBER     only so many modes, of the lowest frequencies at the first speed; default: all, of a' // nl // &
      '                     machine with more than 600 degrees of freedom 100' // nl // &
      '  --range_hz LOW,HIGH  only the modes in this range of frequencies at the first speed [Hz]' // nl // &
      '  --quiet            print nothing but errors', analysis_command)
    call add_command(commands, 'sensitivity', 'FILE...', '--out --set --case --variant --at --modes --range_hz --peaks', &
      'derivatives of frequencies, critical speeds and half ranges by every number', &
      'Differentiates what modes and response answer by every number of the machine: frequencies and damping, with' // nl // &
      '&response also critical speeds, their margins and the half ranges there. Prints for each answer the numbers' // nl // &
      'with the largest effect, as what one per cent more of a number does.' // nl // nl // &
      '  --at equilibrium   modes about the steady state (default), or at rest, as of nocdyn modes' // nl // &
      '  --modes NUMBER     only so many modes, of the lowest frequencies' // nl // &
      '  --range_hz LOW,HIGH  only the modes in this range of frequencies [Hz]' // nl // &
      '  --peaks            also the peaks of a run: the largest magnitudes that a &limit judges' // nl // &
      '  --set PATH=VALUE   override a key' // nl // &
      '  --out DIR          write sensitivity.csv and sensitivity.json to DIR' // nl // &
      case_help, analysis_command)
    call add_command(commands, 'fit', 'FILE...', '--out --set --case --variant --starts --quiet', &
      'find numbers of the machine from measurements', &
      'Finds the values of &unknown with which the machine does what &measurement says, by least squares: with' // nl // &
      'standard errors, correlations, and what the measurements do not tell apart. Writes fitted.nml, the input with' // nl // &
      'the values, fit.csv, fit.json, and fit_NAME.csv of each measurement before and after.' // nl // nl // &
      '  --starts NUMBER    search from so many points between the bounds too; default: 1, the start' // nl // &
      '  --out DIR          write to DIR, with several files to DIR/<name of the file>;' // nl // &
      '                     default: &output directory, else results/<name of the file>' // nl // &
      '  --set PATH=VALUE   override a key' // nl // &
      case_help // nl // &
      '  --quiet            print nothing but errors', analysis_command)
    call add_command(commands, 'orbit', 'FILE...', '--out --set --case --variant --strict --resume --quiet', &
      'periodic motions of nonlinear machines: folds, jumps, stability', &
      'Follows by &orbit the periodic motions of a machine over a number of its input or over the mean speed of a' // nl // &
      'body, by harmonic balance or shooting: where motions jump, where they are unstable, the half ranges of all' // nl // &
      'signals; also limit cycles and backbone curves. Writes orbit.csv and orbit.json.' // nl // nl // &
      '  --out DIR          write to DIR, with several files to DIR/<name of the file>;' // nl // &
      '                     default: &output directory, else results/<name of the file>' // nl // &
      '  --set PATH=VALUE   override a key: orbit.count=101' // nl // &
      case_help // nl // &
      '  --strict           exit code 1 if a limit is exceeded' // nl // &
      '  --resume           continue an interrupted analysis' // nl // &
      '  --quiet            print nothing but errors', analysis_command)
    call add_command(commands, 'transit', 'FILE...', '--out --set --case --variant --strict --quiet', &
      'run through barred ranges of speed: time, peaks, damage of a passage', &
      'Runs the machine as nocdyn run does, and finds the passages of the range of speeds of &transit, or of the' // nl // &
      'ranges that &limit bars: the time in the range, the largest moments and stresses in it against the limits' // nl // &
      'for passing, the cycles and the damage by &fatigue. Writes transit.csv and transit.json.' // nl // nl // &
      '  --out DIR          write to DIR, with several files to DIR/<name of the file>;' // nl // &
      '                     default: &output directory, else results/<name of the file>' // nl // &
      '  --set PATH=VALUE   override a key: transit.passages=20000' // nl // &
      case_help // nl // &
      '  --strict           exit code 1 if a limit is exceeded' // nl // &
      '  --quiet            print nothing but errors', analysis_command)
  end subroutine list_torsional_analyses

  subroutine list_sweeps(commands)
    type(command_t), allocatable, intent(inout) :: commands(:)

    call add_command(commands, 'sweep', 'FILE', '--out --set --case --threads --compile --shard --resume --csv --quiet', &
      'run many variants of a machine', &
      'Runs all variants of a machine that &sweep and &vary of the file describe, and writes the quantities of' // nl // &
      '&record to sweep.nc, with summary.json and input.nml. A variant that fails is recorded with the reason.' // nl // nl // &
      '  --out DIR          write to DIR; default: &output directory, else results/<name of the file>' // nl // &
      '  --set PATH=VALUE   override a key: sweep.samples=1000, vary(2).high=20, run.rtol=1e-9' // nl // &
      '  --case NAME        vary the machine of this &load_case, and write to DIR/NAME/sweep' // nl // &
      '  --threads NUMBER   default: OMP_NUM_THREADS, else the number of cores that the process may use' // nl // &
      '  --compile WHEN     compile a program for the series of this machine: auto (if it pays), always, never' // nl // &
      "  --shard K/N        compute part K of N only, for 'nocdyn merge'" // nl // &
      '  --resume           continue an interrupted sweep' // nl // &
      "  --csv              write sweep.csv too; with shards, 'nocdyn merge' writes it" // nl // &
      '  --quiet            print nothing but errors' // nl // nl // &
      'Results are the same to the last bit for any number of threads, shards or interruptions. On several computers:' // nl // &
      'mpirun -n N nocdyn-mpi sweep FILE, with the same options except --shard.' // nl // nl // &
      'Exit code 1: interrupted, or no variant can be computed.', companion_command)
    call add_command(commands, 'optimise', 'FILE...', '--out --set --case --variant --starts --quiet', &
      'find the best numbers and sizes of a machine', &
      'Finds the values of &design with which &objective is smallest or largest and every &limit is kept: of numbers' // nl // &
      'between bounds, of numbers of a list, of the sizes of catalogues. Writes optimised.nml, the input with the best' // nl // &
      'choice, optimise.csv and optimise.json.' // nl // nl // &
      '  --starts NUMBER    search from so many points between the bounds; default: 4' // nl // &
      '  --out DIR          write to DIR, with several files to DIR/<name of the file>;' // nl // &
      '                     default: &output directory, else results/<name of the file>' // nl // &
      '  --set PATH=VALUE   override a key' // nl // &
      case_help // nl // &
      '  --quiet            print nothing but errors', companion_command)
    call add_command(commands, 'merge', 'DIR', '--csv --quiet', 'combine the parts of a sweep', &
      'Makes sweep.nc and summary.json of the journals that the shards of a sweep have written to DIR.' // nl // nl // &
      '  --csv              write sweep.csv too' // nl // &
      '  --quiet            print nothing but errors' // nl // nl // &
      'Exit code 2: the journals are not of one sweep, or variants are missing.', companion_command)
  end subroutine list_sweeps

  !> Their options are told by themselves, after --help.
  subroutine list_python_commands(commands)
    type(command_t), allocatable, intent(inout) :: commands(:)
    character(len=*), parameter :: on_python = nl // nl // 'Needs Python 3.11 or newer: the one that NOCDYN_PYTHON ' // &
      'names, else one beside nocdyn, else python3 in the PATH.'

    call add_command(commands, 'plot', '[KIND] DIR', passed_on, 'draw results', &
      'Draws the results in DIR, to DIR/figures.' // nl // nl // &
      '  nocdyn plot DIR           all that DIR holds' // nl // &
      '  nocdyn plot KIND DIR      of one KIND: run, modes, campbell, response, orbit, transit, fit, sweep' // nl // &
      '  nocdyn plot KIND --help   the options of a KIND' // nl // &
      '  nocdyn plot paper         compute the two cases of the paper and draw its figures 2 to 5' // on_python, python_command)
    call add_command(commands, 'report', 'FILE', passed_on, 'a report on a machine, HTML and PDF', &
      'Runs what is missing, and writes report.html and report.pdf beside the results.' // nl // nl // &
      '  nocdyn report --help      the options' // on_python, python_command)
    call add_command(commands, 'fmu', 'FILE', passed_on, 'a unit for co-simulation with other programs (FMI)', &
      'Writes a machine as an FMU, NAME.fmu, by FMI 2.0 or 3.0: its inputs are the torques of &excitation kind =' // nl // &
      "'external' and the set speeds of governors, its outputs the columns of a run, its parameters the numbers" // nl // &
      'of its elements.' // nl // nl // &
      '  nocdyn fmu machine.nml          machine.fmu in this folder, by FMI 2.0' // nl // &
      '  nocdyn fmu machine.nml --fmi 3  by FMI 3.0' // nl // &
      '  nocdyn fmu --help               the options' // on_python, python_command)
    call add_command(commands, 'import', 'FILE', passed_on, 'an input from a mass-elastic sheet or from openTorsion', &
      'Writes an input from a mass-elastic sheet, a CSV file with a row for each station, or from a machine of' // nl // &
      'openTorsion in JSON. What of the file is not imported is told. nocdyn check FILE --out DIR writes such a' // nl // &
      'sheet.' // nl // nl // &
      '  nocdyn import machine.csv --out machine.nml' // nl // &
      '  nocdyn import --help      the options' // on_python, python_command)
    call add_command(commands, 'verify', '[CASE]...', passed_on, 'compute cases with known answers and compare', &
      'Computes the verification cases with this program on this machine, all or the chosen ones, and writes' // nl // &
      'verification.html, verification.pdf and verification.json.' // nl // nl // &
      '  nocdyn verify --help      the options' // on_python // nl // nl // 'Exit code 1: a case fails.', python_command)
  end subroutine list_python_commands

end module nocdyn_command_table
