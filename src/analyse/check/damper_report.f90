!> The torsional vibration dampers of a machine, with the numbers that their data sheets give it: printed, and in check.json.
module nocdyn_damper_report
  use nocdyn_bank, only: role_coupling
  use nocdyn_errors, only: error_t
  use nocdyn_formulation, only: formulation_t
  use nocdyn_input, only: input_t
  use nocdyn_json, only: json_t
  use nocdyn_kinds, only: wp
  use nocdyn_linearisation, only: find_slopes
  use nocdyn_machine, only: machine_t
  use nocdyn_reduced, only: new_reduced
  use nocdyn_slopes, only: slopes_t
  use nocdyn_table_text, only: append_table
  use nocdyn_text, only: string_t
  use nocdyn_text_buffer, only: text_buffer_t
  use nocdyn_units, only: from_si, unit_hz
  implicit none (type, external)
  private

  public :: damper_table, put_dampers

  !> What dampers are in the machine, at the start of a run, [dampers].
  type :: dampers_t
    integer, allocatable :: group(:)        ! &damper in the input
    real(wp), allocatable :: ring(:)        ! moment of inertia [kg m2]
    real(wp), allocatable :: stiffness(:)   ! between ring and housing [N m/rad]
    real(wp), allocatable :: damping(:)     ! over the time [N m s/rad]
  contains
    procedure :: tuned
  end type dampers_t

contains

  !> Takes the numbers from the machine.
  subroutine find_dampers(input, machine, self)
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    type(dampers_t), intent(out) :: self
    class(formulation_t), allocatable :: formulation
    type(error_t), allocatable :: ignored   ! numbers that are not finite are written as null
    type(slopes_t) :: slopes
    real(wp), allocatable :: y(:, :)
    integer :: b, d, e

    allocate (self%group, source=input%groups_named('damper'))
    allocate (self%ring(size(self%group)), self%stiffness(size(self%group)), self%damping(size(self%group)), source=0.0_wp)
    if (size(self%group) == 0) return
    allocate (formulation, source=new_reduced(machine, .false.))
    y = formulation%start()
    call find_slopes(formulation, 0.0_wp, y, slopes, ignored)
    do d = 1, size(self%group)
      associate (name => input%groups(self%group(d))%name)
        do b = 1, machine%bodies
          if (machine%names(b)%text == name) self%ring(d) = machine%inertia(1, b)
        end do
        do b = 1, size(machine%banks)
          associate (bank => machine%banks(b)%bank)
            if (bank%role /= role_coupling .or. bank%is_mesh) cycle
            do e = 1, bank%count
              if (bank%names(e)%text /= name) cycle
              self%stiffness(d) = abs(slopes%stiffness(bank%first + e - 1))   ! no -0
              self%damping(d) = slopes%damping(bank%first + e - 1) + slopes%stand_in(bank%first + e - 1)
            end do
          end associate
        end do
      end associate
    end do
  end subroutine find_dampers

  !> Natural frequencies of the rings on held housings [rad/s].
  pure function tuned(self) result(frequencies)
    class(dampers_t), intent(in) :: self
    real(wp), allocatable :: frequencies(:)

    allocate (frequencies, source=sqrt(self%stiffness / self%ring))
  end function tuned

  !> The dampers on lines of their own, '' without any.
  function damper_table(input, machine) result(text)
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    character(len=:), allocatable :: text
    character(len=*), parameter :: headings(*) = [character(len=19) :: 'dampers', 'ring [kg m2]', 'stiffness [N m/rad]', &
                                                  'damping [N m s/rad]', 'tuned to [Hz]']
    type(dampers_t) :: dampers
    type(string_t), allocatable :: labels(:)
    type(text_buffer_t) :: report
    integer :: d

    text = ''
    call find_dampers(input, machine, dampers)
    if (size(dampers%group) == 0) return
    allocate (labels(size(dampers%group)))
    do d = 1, size(labels)
      associate (group => input%groups(dampers%group(d)))
        labels(d)%text = group%name // ', ' // group%text('kind')
      end associate
    end do
    call append_table(report, labels, reshape([dampers%ring, dampers%stiffness, dampers%damping, &
                                               from_si(dampers%tuned(), unit_hz)], [size(labels), 4]), headings, 2, 'more')
    text = report%text()
    text = new_line('a') // text(:len(text) - 1)
  end function damper_table

  !> The list of dampers of check.json.
  subroutine put_dampers(json, input, machine)
    type(json_t), intent(inout) :: json
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine
    type(dampers_t) :: dampers
    real(wp), allocatable :: tuned(:)
    integer :: d

    call find_dampers(input, machine, dampers)
    allocate (tuned, source=dampers%tuned())
    call json%open_list('dampers')
    do d = 1, size(dampers%group)
      associate (group => input%groups(dampers%group(d)))
        call json%open()
        call json%put('name', group%name)
        call json%put('kind', group%text('kind'))
        call json%put('body', group%text('body'))
        call json%put('ring_inertia_kg_m2', dampers%ring(d))
        call json%put('housing_inertia_kg_m2', group%number('housing_inertia'))
        call json%put('stiffness_N_m_rad', dampers%stiffness(d))
        call json%put('damping_N_m_s_rad', dampers%damping(d))
        call json%put('tuning_frequency_rad_s', tuned(d))
        call json%close()
      end associate
    end do
    call json%close_list()
  end subroutine put_dampers

end module nocdyn_damper_report
