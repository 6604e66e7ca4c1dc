!> The commands that are written in Python: plot, report, fmu, verify. They replace this program by Python.
module nocdyn_python_command
  use nocdyn_arguments, only: arguments_t
  use nocdyn_command_line, only: command_line
  use nocdyn_console, only: report_error
  use nocdyn_errors, only: error_t, exit_done, exit_file, raise
  use nocdyn_posix_programs, only: environment, exec_program, program_file, program_folder, program_in_path, set_environment
  use nocdyn_text, only: append, quoted, string_t
  implicit none (type, external)
  private

  public :: python_command

  !> Where the Python packages are, as seen from the program: of an installed one, of one in build/PRESET/bin of the sources.
  character(len=*), parameter :: installed_packages = '../share/nocdyn/python', source_packages = '../../../scripts'
  character(len=*), parameter :: main_module = 'nocdyn_report'

contains

  !> Replaces this program by Python with the words of the command line. Returns only if that fails.
  subroutine python_command(arguments, code)
    type(arguments_t), intent(in) :: arguments
    integer, intent(out) :: code
    type(error_t), allocatable :: error
    character(len=:), allocatable :: failure, packages, python
    type(string_t), allocatable :: words(:)
    integer :: i

    code = exit_done
    call find_packages(packages)
    call find_python(python)
    if (packages == '') then
      call raise(error, exit_file, 'nocdyn ' // arguments%command // ' needs the folder ' // &
                 quoted(program_folder() // installed_packages) // ', which does not exist; cmake --install brings it')
    else if (python == '') then
      call raise(error, exit_file, 'nocdyn ' // arguments%command // ' needs Python, and there is no python3 in the PATH; ' // &
                 'the environment variable NOCDYN_PYTHON can name one')
    else
      if (environment('PYTHONPATH') /= '') packages = packages // ':' // environment('PYTHONPATH')
      call set_environment('PYTHONPATH', packages)
      call set_environment('PYTHONSAFEPATH', '1')   ! no modules of the folder that one works in
      call set_environment('NOCDYN', program_file())
      allocate (words(0))
      call append(words, '-m')
      call append(words, main_module)
      associate (given => command_line())
        do i = 1, size(given)
          call append(words, given(i)%text)
        end do
      end associate
      call exec_program(python, words, failure)
      call raise(error, exit_file, quoted(python) // ', which nocdyn ' // arguments%command // &
                 ' needs, cannot be started: ' // failure)
    end if
    call report_error(error, code)
  end subroutine python_command

  !> The folder of the Python packages, empty if there is none.
  subroutine find_packages(folder)
    character(len=:), allocatable, intent(out) :: folder

    folder = program_folder() // installed_packages
    if (has_packages(folder)) return
    folder = program_folder() // source_packages
    if (.not. has_packages(folder)) folder = ''
  end subroutine find_packages

  logical function has_packages(folder)
    character(len=*), intent(in) :: folder

    inquire (file=folder // '/' // main_module // '/__main__.py', exist=has_packages)
  end function has_packages

  !> The Python that NOCDYN_PYTHON names, else that beside the program, else that of the sources, else that in the
  !> PATH; empty if there is none.
  subroutine find_python(python)
    character(len=:), allocatable, intent(out) :: python
    logical :: exists

    python = environment('NOCDYN_PYTHON')
    if (python /= '') return
    python = program_folder() // 'python3'
    inquire (file=python, exist=exists)
    if (exists) return
    python = program_folder() // source_packages // '/../.venv/bin/python'
    inquire (file=python, exist=exists)
    if (.not. exists) python = program_in_path('python3')
  end subroutine find_python

end module nocdyn_python_command
