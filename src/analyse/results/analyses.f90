!> What an analysis of a machine is: a solver, the files and the text that it leaves. One driver runs them all; a new analysis is
!> a type that extends `analysis_t` and a row in the table of commands.
module nocdyn_analyses
  use nocdyn_errors, only: error_t
  use nocdyn_input, only: input_t
  use nocdyn_machine, only: machine_t
  use nocdyn_output_file, only: output_file_t
  use nocdyn_text, only: string_t
  implicit none (type, external)
  private

  !> What the command line asks for beside the input.
  type, public :: analysis_options_t
    character(len=:), allocatable :: at       !! state about which the machine is linearised; '': that of the analysis
    logical :: has_holzer = .false.           !! whether tables of Holzer are wanted
    logical :: writes_files = .false.         !! whether files are written
    character(len=:), allocatable :: folder   !! of the results of a run of the input
  end type analysis_options_t

  type, abstract, public :: analysis_t
    logical :: is_steady = .true.       !! whether it looks at the machine in a steady state, else over the time
    logical :: locks_joints = .true.    !! whether clutches and freewheels are locked or open for good then
    logical :: always_writes = .false.  !! whether it writes files without --out too
    type(error_t), allocatable :: refusal   !! after `solve`: an error beside a report that can be printed, without files
  contains
    procedure(solve_interface), deferred :: solve
    procedure :: list_files
    procedure :: put_file
    procedure(text_interface), deferred :: text
  end type analysis_t

  abstract interface

    !> Analyses the machine of an input.
    subroutine solve_interface(self, input, machine, options, error)
      import :: analysis_options_t, analysis_t, error_t, input_t, machine_t
      class(analysis_t), intent(inout) :: self
      type(input_t), intent(in) :: input
      type(machine_t), intent(in) :: machine   !! as `is_steady` and `locks_joints` ask for
      type(analysis_options_t), intent(in) :: options
      type(error_t), allocatable, intent(out) :: error
    end subroutine solve_interface

    !> The printed report.
    subroutine text_interface(self, input, text)
      import :: analysis_t, input_t
      class(analysis_t), intent(in) :: self
      type(input_t), intent(in) :: input
      character(len=:), allocatable, intent(out) :: text
    end subroutine text_interface

  end interface

contains

  !> The names of the files of an analysis, which appear together; the report comes last. By default there are none.
  subroutine list_files(self, names)
    class(analysis_t), intent(in) :: self
    type(string_t), allocatable, intent(out) :: names(:)

    allocate (names(0))
  end subroutine list_files

  !> Writes one of these files.
  subroutine put_file(self, input, name, file)
    class(analysis_t), intent(in) :: self
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: name
    type(output_file_t), intent(inout) :: file

    error stop 'nocdyn_analyses: an analysis with files overrides put_file'
  end subroutine put_file

end module nocdyn_analyses
