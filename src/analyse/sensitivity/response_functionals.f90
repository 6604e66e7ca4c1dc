!> What the answers of a response are differentiated by: forms of the modes at critical speeds, half ranges to the first order.
module nocdyn_response_functionals
  use nocdyn_assembly, only: assemble_steady_machine
  use nocdyn_errors, only: error_t, exit_failed, raise
  use nocdyn_excitation_lines, only: list_machine_harmonics, listed_harmonic_t, set_sources, source_t
  use nocdyn_frozen_motions, only: frame_t, frozen_motion_t, new_view, view_t
  use nocdyn_frozen_states, only: displacement_t, frozen_state_t, mean_laws_t
  use nocdyn_held_speeds, only: held_speeds_t, held_state_t, new_held_speeds
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_line_responses, only: line_responses_t
  use nocdyn_machine, only: machine_t
  use nocdyn_moment_forms, only: list_moment_forms, moment_form_t
  use nocdyn_number_changes, only: changed_machine_t, displacement_of, number_change_t
  use nocdyn_response_analysis, only: response_analysis_t
  use nocdyn_response_settings, only: sets_response_speed
  use nocdyn_response_summary, only: critical_t
  use nocdyn_varied_keys, only: near_points
  implicit none (type, external)
  private

  public :: assemble_response_machine, evaluate_critical, evaluate_half

  integer, parameter, public :: of_mode = 3   !! functionals of a critical speed: the form of the mode, the frequency of its line

  !> A critical speed.
  type, public :: critical_answers_t
    type(critical_t) :: critical
    integer :: line = 0
    complex(wp) :: value = 0.0_wp, norm = 0.0_wp, turn = 0.0_wp   !! the mode there, with its forms
    type(frozen_motion_t) :: motion
    type(frozen_state_t) :: frozen
    type(listed_harmonic_t) :: source      !! of the line
    real(wp) :: approach = 0.0_wp          !! of the line to the mode over the speed, dOmega/dn - domega/dn
    integer :: answer = 0                  !! the critical speed among the answers; its margin, if there is one, is the next
    logical :: has_margin = .false.
    real(wp) :: margin_slope = 0.0_wp      !! of the margin by the size of the speed
  end type critical_answers_t

  !> A half range at a speed, which moves with a critical speed.
  type, public :: half_range_answer_t
    type(line_responses_t) :: lines
    type(frozen_state_t) :: frozen
    type(listed_harmonic_t), allocatable :: harmonics(:)
    real(wp) :: speed = 0.0_wp             !! [rad/s]
    real(wp) :: slope = 0.0_wp             !! over the speed, at constant numbers
    integer :: critical = 0                !! with which it moves; 0: the speed stays
    integer :: answer = 0
  end type half_range_answer_t

  !> Those of a response.
  type, public :: response_functionals_t
    type(response_analysis_t) :: analysis
    type(frame_t) :: frame
    type(mean_laws_t) :: laws                      !! of the machine itself
    type(moment_form_t), allocatable :: forms(:)   !! all of the machine
    type(critical_answers_t), allocatable :: criticals(:)
    type(half_range_answer_t), allocatable :: halves(:)
  contains
    procedure :: differentiate_near, evaluate
  end type response_functionals_t

contains

  !> The machine as a response looks at it.
  subroutine assemble_response_machine(input, machine, error)
    type(input_t), intent(in) :: input
    type(machine_t), intent(out) :: machine
    type(error_t), allocatable, intent(out) :: error

    call assemble_steady_machine(input, .true., machine, error, sets_speed=sets_response_speed(input))
  end subroutine assemble_response_machine

  !> The form of the mode of a critical speed in a changed machine or state, and the frequency of its line.
  subroutine evaluate_critical(self, one, view, machine, state, keeps_harmonics, values)
    class(response_functionals_t), intent(in) :: self
    type(critical_answers_t), intent(in) :: one
    type(view_t), intent(in) :: view
    type(machine_t), intent(in) :: machine
    type(held_state_t), intent(in) :: state
    logical, intent(in) :: keeps_harmonics   !! whether the harmonics are those of the machine and state themselves
    real(wp), intent(out) :: values(:)
    complex(wp) :: form
    type(source_t), allocatable :: sources(:)

    form = one%motion%form(one%motion, self%frame, view, machine, state%slopes, one%value)
    values(:2) = [real(form, wp), aimag(form)]
    if (keeps_harmonics) then
      call set_sources([one%source], state, sources)
    else
      call list_again([one%source], machine, state, self%analysis%response%shaker, sources, one%source%lister)
    end if
    values(3) = sources(1)%frequency
  end subroutine evaluate_critical

  subroutine differentiate_near(self, number, slopes, is_done, error)
    class(response_functionals_t), intent(inout) :: self
    type(number_change_t), intent(inout) :: number
    real(wp), intent(out) :: slopes(:)
    logical, intent(out) :: is_done
    type(error_t), allocatable, intent(out) :: error
    type(changed_machine_t) :: near(near_points)
    integer :: i

    slopes = 0.0_wp
    is_done = number%body > 0
    if (is_done) then
      call differentiate_by_inertia(self, number%body, slopes)
      return
    end if
    is_done = all([(self%criticals(i)%frozen%is_frozen, i=1, size(self%criticals))]) .and. &
              all([(self%halves(i)%frozen%is_frozen, i=1, size(self%halves))])
    if (is_done) call number%list_machines(self%laws, .true., self%frame, near, is_done, error)
    if (allocated(error) .or. .not. is_done) return
    call differentiate_criticals(self, number, near, slopes(:of_mode * size(self%criticals)), error)
    if (.not. allocated(error)) call differentiate_halves(self, number, near, slopes(of_mode * size(self%criticals) + 1:), error)
  end subroutine differentiate_near

  !> No steady state depends on an inertia.
  subroutine differentiate_by_inertia(self, body, slopes)
    class(response_functionals_t), intent(in) :: self
    integer, intent(in) :: body
    real(wp), intent(inout) :: slopes(:)   !! all are 0 before
    complex(wp) :: form
    integer :: i

    do i = 1, size(self%criticals)
      form = self%criticals(i)%value**2 * self%criticals(i)%motion%angle(body)**2
      slopes(of_mode * (i - 1) + 1:of_mode * (i - 1) + 2) = [real(form, wp), aimag(form)]
    end do
    do i = 1, size(self%halves)
      slopes(of_mode * size(self%criticals) + i) = self%halves(i)%lines%slope_by_inertia(body)
    end do
  end subroutine differentiate_by_inertia

  subroutine differentiate_criticals(self, number, near, slopes, error)
    class(response_functionals_t), intent(inout) :: self
    type(number_change_t), intent(in) :: number
    type(changed_machine_t), intent(inout) :: near(near_points)
    real(wp), intent(inout) :: slopes(:)   !! all are 0 before, [of_mode * critical speeds]
    type(error_t), allocatable, intent(out) :: error
    type(displacement_t) :: displacement
    type(held_state_t) :: state
    type(view_t) :: view
    integer :: i, p
    logical :: keeps
    real(wp) :: values(of_mode)

    associate (response => self%analysis%response)
      do i = 1, size(self%criticals)
        associate (one => self%criticals(i), slope => slopes(of_mode * (i - 1) + 1:of_mode * i))
          call displacement_of(one%frozen, number%key, self%laws, near, displacement)
          do p = 1, near_points
            call near(p)%laws%state_at(one%frozen, displacement, number%key%near(p), state, error)
            if (allocated(error)) return
            keeps = keeps_harmonics(number, near(p), one%frozen%state, state)
            if (near(p)%is_assembled) then
              call evaluate_critical(self, one, near(p)%view, near(p)%machine, state, keeps, values)
            else
              call evaluate_critical(self, one, view, response%machine, state, keeps, values)
            end if
            slope = slope + number%key%near_weight(p) * values
          end do
          if (.not. abs(number%key%near_weight_here) > 0) cycle
          call evaluate_critical(self, one, view, response%machine, one%frozen%state, .true., values)
          slope = slope + number%key%near_weight_here * values
        end associate
      end do
    end associate
  end subroutine differentiate_criticals

  subroutine differentiate_halves(self, number, near, slopes, error)
    class(response_functionals_t), intent(inout) :: self
    type(number_change_t), intent(in) :: number
    type(changed_machine_t), intent(inout) :: near(near_points)
    real(wp), intent(inout) :: slopes(:)   !! all are 0 before, [half ranges]
    type(error_t), allocatable, intent(out) :: error
    type :: machine_forms_t
      type(moment_form_t), allocatable :: all(:)
    end type machine_forms_t
    type(displacement_t) :: displacement
    type(machine_forms_t) :: forms(near_points)
    type(held_state_t) :: state
    type(view_t) :: view
    integer :: i, p
    logical :: keeps
    real(wp) :: value

    associate (response => self%analysis%response)
      do p = 1, near_points
        if (near(p)%is_assembled) call list_moment_forms(near(p)%machine, self%analysis%settings%body, forms(p)%all)
      end do
      do i = 1, size(self%halves)
        associate (half => self%halves(i))
          call displacement_of(half%frozen, number%key, self%laws, near, displacement)
          do p = 1, near_points
            call near(p)%laws%state_at(half%frozen, displacement, number%key%near(p), state, error)
            if (allocated(error)) return
            keeps = keeps_harmonics(number, near(p), half%frozen%state, state)
            if (near(p)%is_assembled) then
              call evaluate_half(self, half, near(p)%view, near(p)%machine, forms(p)%all, state, keeps, value)
            else
              call evaluate_half(self, half, view, response%machine, self%forms, state, keeps, value)
            end if
            slopes(i) = slopes(i) + number%key%near_weight(p) * value
          end do
          if (.not. abs(number%key%near_weight_here) > 0) cycle
          call evaluate_half(self, half, view, response%machine, self%forms, half%frozen%state, .true., value)
          slopes(i) = slopes(i) + number%key%near_weight_here * value
        end associate
      end do
    end associate
  end subroutine differentiate_halves

  !> A half range in a changed machine or state, to the first order.
  subroutine evaluate_half(self, half, view, machine, forms, state, keeps_harmonics, value)
    class(response_functionals_t), intent(in) :: self
    type(half_range_answer_t), intent(in) :: half
    type(view_t), intent(in) :: view
    type(machine_t), intent(in) :: machine
    type(moment_form_t), intent(in) :: forms(:)   !! of the machine
    type(held_state_t), intent(in) :: state
    logical, intent(in) :: keeps_harmonics        !! as of `evaluate_critical`
    real(wp), intent(out) :: value
    type(source_t), allocatable :: sources(:)

    if (keeps_harmonics) then
      call set_sources(half%harmonics, state, sources)
    else
      call list_again(half%harmonics, machine, state, self%analysis%response%shaker, sources)
    end if
    value = half%lines%changed(self%analysis%response, self%frame, view, machine, state, sources, forms(half%lines%form))
  end subroutine evaluate_half

  !> Known harmonics as sources in a changed machine or state. Those that are rounding come and go.
  subroutine list_again(known, machine, state, shaker, sources, only)
    type(listed_harmonic_t), intent(in) :: known(:)
    type(machine_t), intent(in) :: machine
    type(held_state_t), intent(in) :: state
    integer, intent(in) :: shaker
    type(source_t), allocatable, intent(out) :: sources(:)
    integer, intent(in), optional :: only   !! as of `list_machine_harmonics`
    type(listed_harmonic_t), allocatable :: list(:)
    type(listed_harmonic_t) :: again(size(known))
    integer :: i, k, next

    call list_machine_harmonics(machine, state, list, shaker, only)
    again = known
    next = 1
    do i = 1, size(known)
      again(i)%harmonic%amplitude = 0.0_wp
      do k = next, size(list)
        if (.not. is_same(list(k), known(i))) cycle
        again(i) = list(k)
        next = k + 1
        exit
      end do
    end do
    call set_sources(again, state, sources)
  end subroutine list_again

  !> Whether two harmonics are one, up to small changes.
  elemental logical function is_same(a, b)
    type(listed_harmonic_t), intent(in) :: a, b
    real(wp), parameter :: small = 0.02_wp   ! relative

    is_same = a%lister == b%lister .and. a%harmonic%element == b%harmonic%element .and. a%harmonic%body == b%harmonic%body &
              .and. (a%harmonic%is_twist .eqv. b%harmonic%is_twist) &
              .and. abs(a%harmonic%order - b%harmonic%order) <= small * abs(b%harmonic%order) &
              .and. abs(a%harmonic%frequency - b%harmonic%frequency) <= small * abs(b%harmonic%frequency)
  end function is_same

  !> Whether the elements list the same harmonics: no speed of theirs is another one.
  pure logical function keeps_harmonics(number, near, before, state)
    type(number_change_t), intent(in) :: number
    type(changed_machine_t), intent(in) :: near
    type(held_state_t), intent(in) :: before, state
    real(wp), parameter :: none = 1.0e-15_wp   ! of a speed

    keeps_harmonics = (number%keeps_harmonics .or. .not. near%is_assembled) .and. &
                      all(abs(state%omega - before%omega) <= none * abs(before%omega))
  end function keeps_harmonics

  subroutine evaluate(self, number, values, error)
    class(response_functionals_t), intent(in) :: self
    type(number_change_t), intent(in) :: number
    real(wp), intent(out) :: values(:)
    type(error_t), allocatable, intent(out) :: error
    type(held_speeds_t) :: held
    type(machine_t) :: machine
    type(moment_form_t), allocatable :: forms(:)
    type(view_t) :: view
    logical :: is_changed

    associate (response => self%analysis%response)
      values = 0.0_wp
      held = response%held
      call number%change_held(held, is_changed)
      if (is_changed) then
        call evaluate_changed(self, view, response%machine, self%forms, held, values, error)
        return
      end if
      call assemble_response_machine(number%input, machine, error)
      if (allocated(error)) return
      view = new_view(self%frame, machine)
      if (.not. view%is_alike) then
        call raise(error, exit_failed, 'it changes the coordinates or the nodes of shafts')
        return
      end if
      call new_held_speeds(machine, self%analysis%settings%body, held, error, is_free=response%shaker > 0)
      if (allocated(error)) return
      call list_moment_forms(machine, self%analysis%settings%body, forms)
      call evaluate_changed(self, view, machine, forms, held, values, error)
    end associate
  end subroutine evaluate

  !> The functionals of a changed machine, whose steady states are found anew.
  subroutine evaluate_changed(self, view, machine, forms, held, values, error)
    class(response_functionals_t), intent(in) :: self
    type(view_t), intent(in) :: view
    type(machine_t), intent(in) :: machine
    type(moment_form_t), intent(in) :: forms(:)   !! of the machine
    type(held_speeds_t), intent(inout) :: held    !! its steady states
    real(wp), intent(out) :: values(:)
    type(error_t), allocatable, intent(out) :: error
    type(held_state_t) :: state
    integer :: i

    do i = 1, size(self%criticals)
      call held%hold(self%criticals(i)%critical%crossing%speed, state, error)
      if (allocated(error)) return
      call evaluate_critical(self, self%criticals(i), view, machine, state, .false., values(of_mode * (i - 1) + 1:of_mode * i))
    end do
    do i = 1, size(self%halves)
      call held%hold(self%halves(i)%speed, state, error)
      if (allocated(error)) return
      call evaluate_half(self, self%halves(i), view, machine, forms, state, .false., values(of_mode * size(self%criticals) + i))
    end do
  end subroutine evaluate_changed

end module nocdyn_response_functionals
