!> Natural frequencies and damping ratios about the operating point, as answers that are differentiated.
!>
!> With T(lambda) x = 0 and T symmetric, an eigenvalue lambda = sigma + i omega changes by
!>   x^T T_lambda x d lambda + x^T T_omega x d omega = -x^T dT x,
!> where T_omega is there for relative damping, which is that at the frequency of the mode. Equal eigenvalues share their motions:
!> their changes are those of the pencil of these forms for all of them.
module nocdyn_mode_answers
  use nocdyn_answers, only: answers_t
  use nocdyn_assembly, only: assemble_steady_machine
  use nocdyn_band_pencil, only: band_pencil_t, new_band_pencil
  use nocdyn_errors, only: error_t, exit_failed, exit_input, raise
  use nocdyn_frozen_motions, only: eigenvalue_change, frame_t, frozen_motion_t, new_frame, new_view, view_t
  use nocdyn_frozen_states, only: displacement_t, freeze_equilibrium, frozen_state_t, mean_laws_t
  use nocdyn_formulation, only: formulation_t
  use nocdyn_held_speeds, only: held_state_t
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_lapack, only: ascending_order
  use nocdyn_lapack_complex, only: complex_eigenvectors
  use nocdyn_linearisation, only: find_slopes, has_turning_losses, held_elements
  use nocdyn_machine, only: machine_t
  use nocdyn_mode_choice, only: note_choice
  use nocdyn_operating_point, only: find_operating_point, operating_point_t
  use nocdyn_number_changes, only: changed_machine_t, displacement_of, number_change_t
  use nocdyn_slopes, only: slopes_t
  use nocdyn_text, only: append, rounded_text, string_t, to_text
  use nocdyn_torque_balance, only: set_up_balance, torque_balance_t
  use nocdyn_units, only: from_si, unit_hz
  use nocdyn_varied_keys, only: near_points
  use nocdyn_wanted_modes, only: choose_numbers, find_covering, modes_choice_t, wanted_modes_t
  implicit none (type, external)
  private

  public :: new_mode_answers

  real(wp), parameter :: same = 1.0e-7_wp, near = 0.01_wp   ! relative distance of eigenvalues

  type, extends(answers_t), public :: mode_answers_t
    type(frame_t), private :: frame
    type(mean_laws_t), private :: laws                 !! of the machine, at the operating point
    type(frozen_state_t), private :: frozen            !! this, if it is a steady state
    type(slopes_t), private :: slopes
    character(len=:), allocatable, private :: at       !! the state: 'equilibrium', ...
    complex(wp), allocatable, private :: value(:)      !! eigenvalues [1/s], [modes]
    type(frozen_motion_t), allocatable, private :: motion(:)
    integer, allocatable, private :: first(:)          !! the first of the modes with the same eigenvalue, [modes]
    integer, allocatable, private :: partner(:, :)     !! pairs of modes whose forms are functionals, [2, pairs]
    complex(wp), allocatable, private :: norm(:)       !! their forms with T_lambda, [pairs]
    complex(wp), allocatable, private :: turn(:)       !! their forms with T_omega, [pairs]
  contains
    procedure :: differentiate_near, evaluate, finish
  end type mode_answers_t

contains

  !> Finds the modes of an input.
  subroutine new_mode_answers(input, at, choice, self, notes, error)
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: at           !! as of `find_operating_point`
    type(modes_choice_t), intent(in) :: choice
    type(mode_answers_t), intent(out) :: self
    type(string_t), allocatable, intent(inout) :: notes(:)
    type(error_t), allocatable, intent(out) :: error
    type(band_pencil_t) :: pencil
    type(machine_t) :: machine
    type(operating_point_t) :: point
    type(slopes_t) :: slopes
    type(wanted_modes_t) :: found
    integer, allocatable :: held(:), order(:)
    integer :: i, wanted(2)
    character(len=:), allocatable :: label

    self%at = at
    call find_state(input, at, machine, point, slopes, error)
    if (allocated(error)) return
    if (has_turning_losses(point%formulation)) then
      call raise(error, exit_input, 'the teeth of this machine lose power while it vibrates, which makes its matrices ' // &
                 'unsymmetric: there are no derivatives of its modes')
      return
    end if
    allocate (held, source=held_elements(point%formulation))
    self%laws%machine = point%formulation%machine
    self%laws%state = point%formulation%state
    self%slopes = slopes
    if (at == 'equilibrium') call freeze(point, self%frozen)
    self%frame = new_frame(point%formulation%machine)
    call new_band_pencil(point%formulation%machine, self%frame%incidence, slopes%stiffness, held, pencil, error)
    if (allocated(error)) return
    if (pencil%rigid == pencil%modes) then
      call raise(error, exit_failed, 'nothing of this machine is elastic: it has no natural frequencies')
      return
    end if
    call choose_numbers(pencil, choice, wanted, error)
    if (.not. allocated(error)) call find_covering(point%formulation%machine, pencil, slopes, held, choice, wanted, found, error)
    if (allocated(error)) return
    associate (pairs => found%damped%pairs)
      order = pack(found%chosen, aimag(pairs%value(found%chosen)) > 0)
      order = order(ascending_order(aimag(pairs%value(order))))
      self%value = pairs%value(order)
      allocate (self%motion(size(order)))
      do i = 1, size(order)
        self%motion(i)%x = pairs%x(:, order(i))
        self%motion(i)%twist = pairs%twist(:, order(i))
        self%motion(i)%angle = pairs%angle(:, order(i))
      end do
    end associate
    if (choice%has_range) call note_choice(choice, pencil%modes - pencil%rigid, max(0, wanted(1) - 1 - pencil%rigid), &
                                           size(order), notes)
    allocate (self%answers(2 * size(order)))
    do i = 1, size(order)
      label = 'mode ' // to_text(i + max(0, wanted(1) - 1 - pencil%rigid))
      call self%answers(2 * i - 1)%set('frequency', label, 'Hz', from_si(aimag(self%value(i)), unit_hz))
      call self%answers(2 * i)%set('damping ratio', label, '', -real(self%value(i), wp) / abs(self%value(i)))
    end do
    ! groups of equal eigenvalues, whose motions are made orthogonal
    self%first = [(i, i=1, size(order))]
    do i = 2, size(order)
      if (abs(self%value(i) - self%value(i - 1)) <= same * abs(self%value(i))) self%first(i) = self%first(i - 1)
    end do
    call list_partners(self%first, self%partner)
    allocate (self%norm(size(self%partner, 2)), self%turn(size(self%partner, 2)))
    do i = 1, size(self%norm)
      associate (motion => self%motion(self%partner(1, i)), other => self%motion(self%partner(2, i)))
        self%norm(i) = motion%form_of_slope(other, point%formulation%machine, slopes, self%value(self%partner(1, i)))
        self%turn(i) = motion%form_of_frequency(other, slopes, self%value(self%partner(1, i)))
      end associate
    end do
    allocate (self%scale(2 * size(self%norm)))
    do i = 1, size(self%norm)
      self%scale(2 * i - 1:2 * i) = maxval(abs(self%norm)) * abs(self%value(self%partner(1, i)))
    end do
    self%functionals = 2 * size(self%partner, 2)
    call note_neighbours(self, notes)
  end subroutine new_mode_answers

  !> The pairs of modes with the same eigenvalue, each mode with itself too.
  subroutine list_partners(first, partner)
    integer, intent(in) :: first(:)                     !! the first of the modes with the same eigenvalue, [modes]
    integer, allocatable, intent(out) :: partner(:, :)
    integer :: i, k, n

    allocate (partner(2, sum([(i - first(i) + 1, i=1, size(first))])))
    n = 0
    do i = 1, size(first)
      do k = first(i), i
        n = n + 1
        partner(:, n) = [i, k]
      end do
    end do
  end subroutine list_partners

  !> Says which modes are so near to each other that their derivatives hold for small changes only, or are shared.
  subroutine note_neighbours(self, notes)
    type(mode_answers_t), intent(in) :: self
    type(string_t), allocatable, intent(inout) :: notes(:)
    real(wp) :: distance
    integer :: i
    character(len=:), allocatable :: both

    do i = 2, size(self%value)
      both = self%answers(2 * i - 3)%label // ' and ' // self%answers(2 * i - 1)%label
      distance = abs(self%value(i) - self%value(i - 1)) / abs(self%value(i))
      if (self%first(i) == self%first(i - 1)) then
        call append(notes, both // ' have the same frequency: a change splits them, and the derivatives are those of the ' // &
                           'lower and of the higher one')
      else if (distance <= near) then
        call append(notes, both // ' are ' // rounded_text(100.0_wp * distance, 2) // ' % apart: their derivatives hold for ' // &
                           'changes that move them less')
      end if
    end do
  end subroutine note_neighbours

  !> The state about which an input is linearised, and the slopes there.
  subroutine find_state(input, at, machine, point, slopes, error)
    type(input_t), intent(in) :: input
    character(len=*), intent(in) :: at
    type(machine_t), intent(out) :: machine
    type(operating_point_t), intent(out) :: point
    type(slopes_t), intent(out) :: slopes
    type(error_t), allocatable, intent(out) :: error

    call assemble_steady_machine(input, .false., machine, error)
    if (.not. allocated(error)) call find_operating_point(input, machine, at, point, error)
    if (.not. allocated(error)) call find_slopes(point%formulation, point%t, point%y, slopes, error)
  end subroutine find_state

  !> Keeps a steady state that has just been linearised.
  subroutine freeze(point, frozen)
    type(operating_point_t), intent(in) :: point
    type(frozen_state_t), intent(out) :: frozen
    class(formulation_t), allocatable :: formulation
    type(torque_balance_t) :: balance

    allocate (formulation, source=point%formulation)
    call set_up_balance(formulation, point%t, balance)
    call freeze_equilibrium(balance, frozen)
  end subroutine freeze

  subroutine differentiate_near(self, number, slopes, is_done, error)
    class(mode_answers_t), intent(inout) :: self
    type(number_change_t), intent(inout) :: number
    real(wp), intent(out) :: slopes(:)
    logical, intent(out) :: is_done
    type(error_t), allocatable, intent(out) :: error
    type(changed_machine_t) :: near(near_points)
    type(displacement_t) :: displacement
    type(held_state_t) :: state
    complex(wp) :: form
    real(wp) :: values(size(slopes))
    integer :: p

    slopes = 0.0_wp
    is_done = number%body > 0
    if (is_done) then
      do p = 1, size(self%partner, 2)
        associate (i => self%partner(1, p), k => self%partner(2, p), b => number%body)
          form = self%value(i)**2 * self%motion(i)%angle(b) * self%motion(k)%angle(b)
        end associate
        slopes(2 * p - 1:2 * p) = [real(form, wp), aimag(form)]
      end do
      return
    end if
    if (.not. self%frozen%is_frozen) return
    call number%list_machines(self%laws, .false., self%frame, near, is_done, error)
    if (allocated(error) .or. .not. is_done) return
    call displacement_of(self%frozen, number%key, self%laws, near, displacement)
    do p = 1, near_points
      call near(p)%laws%state_at(self%frozen, displacement, number%key%near(p), state, error)
      if (allocated(error)) return
      call evaluate_forms(self, near(p)%view, near(p)%laws%machine, state%slopes, values)
      slopes = slopes + number%key%near_weight(p) * values
    end do
    if (.not. abs(number%key%near_weight_here) > 0) return
    call evaluate_forms(self, new_view(self%frame, self%laws%machine), self%laws%machine, self%slopes, values)
    slopes = slopes + number%key%near_weight_here * values
  end subroutine differentiate_near

  subroutine evaluate(self, number, values, error)
    class(mode_answers_t), intent(in) :: self
    type(number_change_t), intent(in) :: number
    real(wp), intent(out) :: values(:)
    type(error_t), allocatable, intent(out) :: error
    type(machine_t) :: machine
    type(operating_point_t) :: operating
    type(slopes_t) :: slopes
    type(view_t) :: view

    values = 0.0_wp
    call find_state(number%input, self%at, machine, operating, slopes, error)
    if (allocated(error)) return
    view = new_view(self%frame, operating%formulation%machine)
    if (.not. view%is_alike) then
      call raise(error, exit_failed, 'it changes the coordinates or the nodes of shafts')
      return
    end if
    call evaluate_forms(self, view, operating%formulation%machine, slopes, values)
  end subroutine evaluate

  subroutine evaluate_forms(self, view, machine, slopes, values)
    type(mode_answers_t), intent(in) :: self
    type(view_t), intent(in) :: view
    type(machine_t), intent(in) :: machine
    type(slopes_t), intent(in) :: slopes
    real(wp), intent(out) :: values(:)
    complex(wp) :: form
    integer :: p

    do p = 1, size(self%partner, 2)
      associate (i => self%partner(1, p), k => self%partner(2, p))
        form = self%motion(i)%form(self%motion(k), self%frame, view, machine, slopes, self%value(i))
      end associate
      values(2 * p - 1:2 * p) = [real(form, wp), aimag(form)]
    end do
  end subroutine evaluate_forms

  subroutine finish(self, slopes)
    class(mode_answers_t), intent(inout) :: self
    real(wp), intent(in) :: slopes(:, :)
    complex(wp) :: change(size(self%value), size(slopes, 2))
    integer :: i, p

    change = (0.0_wp, 0.0_wp)
    do p = 1, size(self%partner, 2)
      if (self%partner(1, p) /= self%partner(2, p)) cycle
      change(self%partner(1, p), :) = eigenvalue_change(self%norm(p), self%turn(p), &
                                                        cmplx(slopes(2 * p - 1, :), slopes(2 * p, :), wp))
    end do
    call split_equal(self, slopes, change)
    do i = 1, size(self%value)
      associate (value => self%value(i))
        self%answers(2 * i - 1)%derivative = from_si(aimag(change(i, :)), unit_hz)
        self%answers(2 * i)%derivative = (-real(change(i, :), wp) + real(value, wp) * real(conjg(value) * change(i, :), wp) &
                                                                    / abs(value)**2) / abs(value)
      end associate
    end do
  end subroutine finish

  !> The changes of equal eigenvalues, ascending by those of the frequencies.
  subroutine split_equal(self, slopes, change)
    class(mode_answers_t), intent(in) :: self
    real(wp), intent(in) :: slopes(:, :)
    complex(wp), intent(inout) :: change(:, :)   !! [modes, keys]
    complex(wp), allocatable :: form(:, :), norm(:, :), turn(:, :)
    integer :: f, k, n, p

    do f = 1, size(self%first)
      n = count(self%first == f)
      if (n < 2) cycle
      allocate (form(n, n), norm(n, n), turn(n, n))
      do k = 1, size(slopes, 2)
        do p = 1, size(self%partner, 2)
          if (self%first(self%partner(1, p)) /= f) cycle
          associate (a => self%partner(1, p) - f + 1, b => self%partner(2, p) - f + 1)
            form(a, b) = cmplx(slopes(2 * p - 1, k), slopes(2 * p, k), wp)
            norm(a, b) = self%norm(p)
            turn(a, b) = self%turn(p)
            form(b, a) = form(a, b)
            norm(b, a) = norm(a, b)
            turn(b, a) = turn(a, b)
          end associate
        end do
        call split(form, norm, turn, change(f:f + n - 1, k))
      end do
      deallocate (form, norm, turn)
    end do
  end subroutine split_equal

  !> The changes of the eigenvalues of one group. Those by T_omega depend on the change itself, and are iterated.
  subroutine split(form, norm, turn, change)
    complex(wp), intent(in) :: form(:, :), norm(:, :), turn(:, :)
    complex(wp), intent(inout) :: change(:)
    integer, parameter :: most_rounds = 100
    real(wp), parameter :: accuracy = 1.0e-13_wp
    complex(wp), dimension(size(change), size(change)) :: left, right, vectors
    complex(wp) :: values(size(change))
    integer :: i, order(size(change)), round
    logical :: has_failed
    real(wp) :: before

    do i = 1, size(change)
      change(i) = (0.0_wp, 0.0_wp)
      do round = 1, most_rounds
        left = -form - aimag(change(i)) * turn
        right = norm
        call complex_eigenvectors(left, right, values, vectors, has_failed)
        if (has_failed) exit
        order = ascending_order(aimag(values))
        before = aimag(change(i))
        change(i) = values(order(i))
        if (abs(aimag(change(i)) - before) <= accuracy * abs(change(i)) .or. .not. any(abs(turn) > 0)) exit
      end do
    end do
  end subroutine split

end module nocdyn_mode_answers
