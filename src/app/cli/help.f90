!> The help texts of the command line.
module nocdyn_help
  implicit none (type, external)
  private

  public :: command_help

  character(len=*), parameter :: nl = new_line('a')

contains

  !> Help on a command, on the program if `command` is empty; empty if there is no such command.
  pure function command_help(command) result(text)
    character(len=*), intent(in) :: command
    character(len=:), allocatable :: text

    select case (command)
    case ('')
      text = overview()
    case ('run')
      text = 'nocdyn run FILE... [--out DIR] [--set PATH=VALUE]... [--quiet]' // nl // nl // &
             'Integrates every input file and writes trajectory.csv, summary.json and input.nml.' // nl // nl // &
             '  --out DIR          write to DIR, with several files to DIR/<name of the file>;' // nl // &
             '                     without it &output directory counts, else results/<name of the file>' // nl // &
             '  --set PATH=VALUE   override a key: run.rtol=1e-9, load.work.viscous=80, gear.reducer.radii=2,3' // nl // &
             '  --quiet            print nothing but errors' // nl // nl // &
             'A bad file does not stop the others; the exit code is the worst of all. Ctrl-C ends the run and keeps' // nl // &
             'what there is as trajectory.partial.csv; so does a computation that fails.'
    case ('check')
      text = 'nocdyn check FILE... [--set PATH=VALUE]...' // nl // nl // &
             'Reads the files and analyses the machines: every mistake with its line, degrees of freedom,' // nl // &
             'independent coordinates, ratios between geared bodies, redundant gears; and the sweep, if there is one.'
    case ('equilibrium')
      text = 'nocdyn equilibrium FILE... [--set PATH=VALUE]... [--out DIR]' // nl // nl // &
             'Finds the steady states of the machines: constant speeds at which the mean torques balance, and the' // nl // &
             'twists with which the couplings carry them. Several solutions of a motor curve are told apart, with' // nl // &
             'their stability. Excitations count with their mean.' // nl // nl // &
             '  --out DIR          write equilibrium.json to DIR, with several files to DIR/<name of the file>' // nl // nl // &
             'Exit code 1: nothing balances the torques.'
    case ('modes')
      text = 'nocdyn modes FILE... [--at equilibrium|rest|TIME] [--set PATH=VALUE]... [--out DIR]' // nl // nl // &
             'Linearises the machines and prints their natural frequencies, damping ratios, time constants and' // nl // &
             'where the energy of each mode is.' // nl // nl // &
             '  --at equilibrium   about the steady state (default): of several, the stable one nearest to the start' // nl // &
             '  --at rest          at the start angles, with all speeds zero and mean torques' // nl // &
             '  --at TIME          at a time of the run [s], which is integrated up to there' // nl // &
             '  --out DIR          write modes.csv and modes.json to DIR, with several files to DIR/<name of the file>'
    case ('sweep')
      text = sweep_help()
    case ('merge')
      text = 'nocdyn merge DIR [--csv] [--quiet]' // nl // nl // &
             'Makes sweep.nc and summary.json of the journals that the shards of a sweep have left in DIR.' // nl // nl // &
             '  --csv              write sweep.csv too' // nl // &
             '  --quiet            print nothing but errors' // nl // nl // &
             'Exit code 2: the journals do not belong together, or variants are missing.'
    case ('matrices')
      text = 'nocdyn matrices FILE [--set PATH=VALUE]...' // nl // nl // &
             'Prints every matrix and vector of the method for the machine at its start, with the number of' // nl // &
             'its equation.'
    case ('new')
      text = 'nocdyn new FILE' // nl // nl // 'Writes a commented input file; a file that exists is left alone.'
    case ('help')
      text = 'nocdyn help [COMMAND], nocdyn help input [GROUP]'
    case default
      text = ''
    end select
  end function command_help

  pure function sweep_help() result(text)
    character(len=:), allocatable :: text

    text = 'nocdyn sweep FILE [--out DIR] [--set PATH=VALUE]... [--threads NUMBER] [--shard K/N] [--resume] [--csv]' // nl // &
           '             [--quiet]' // nl // nl // &
           'Runs all variants of a machine that &sweep and &vary of the file describe, and writes what &record asks' // nl // &
           'for to sweep.nc, with summary.json and input.nml. A variant that fails is recorded with its reason.' // nl // nl // &
           '  --out DIR          write to DIR; without it &output directory counts, else results/<name of the file>' // nl // &
           '  --set PATH=VALUE   override a key: sweep.samples=1000, vary(2).high=20, run.rtol=1e-9' // nl // &
           '  --threads NUMBER   without it OMP_NUM_THREADS counts, else the cores that the process may use' // nl // &
           "  --shard K/N        compute part K of N only, for 'nocdyn merge'" // nl // &
           '  --resume           go on where an interrupted sweep has stopped' // nl // &
           "  --csv              write sweep.csv too; of shards, 'nocdyn merge' writes it" // nl // &
           '  --quiet            print nothing but errors' // nl // nl // &
           'Results are the same to the last bit for any number of threads, shards or interruptions. On many machines:' // nl // &
           'mpirun -n N nocdyn-mpi sweep FILE, with the same options but --shard.' // nl // nl // &
           'Exit code 1: interrupted, or no variant can be computed.'
  end function sweep_help

  pure function overview() result(text)
    character(len=:), allocatable :: text

    text = 'nocdyn: dynamics of drivetrains: rotating bodies, nonlinear elastic couplings, gears.' // nl // nl // &
           '  nocdyn run FILE...         integrate machines and write their results' // nl // &
           '  nocdyn check FILE...       read and analyse, integrate nothing' // nl // &
           '  nocdyn equilibrium FILE... steady running: speeds, torques, twists, powers, stability' // nl // &
           '  nocdyn modes FILE...       natural frequencies, damping, shapes and energies of the modes' // nl // &
           '  nocdyn sweep FILE          run many variants of a machine' // nl // &
           '  nocdyn merge DIR           put the parts of a sweep together' // nl // &
           '  nocdyn matrices FILE       print the matrices of the method for a machine' // nl // &
           '  nocdyn new FILE            write a commented input to start from' // nl // &
           '  nocdyn help [COMMAND]      help on a command' // nl // &
           '  nocdyn help input [GROUP]  the groups and keys of an input file' // nl // &
           '  nocdyn --version' // nl // nl // &
           'Exit codes: 0 done, 1 a computation failed, 2 wrong usage or input, 3 a file cannot be read or written.'
  end function overview

end module nocdyn_help
