!> Numbers that analyses answer, and their derivatives by the numbers of a machine.
!>
!> Answers of one kind are a group: it knows some functionals, real numbers that a changed machine gives with the motions of the
!> machine itself, and makes the derivatives of its answers of the derivatives of these. The steady states stay too, and move by
!> their derivatives (`nocdyn_frozen_states`), or are found anew where that is not known.
module nocdyn_answers
  use nocdyn_errors, only: error_t, exit_failed, raise
  use nocdyn_finite, only: is_finite
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_number_changes, only: number_change_t
  use nocdyn_text, only: append, joined, string_t
  use nocdyn_varied_keys, only: points, varied_key_t
  implicit none (type, external)
  private

  public :: differentiate

  !> One answer.
  type, public :: answer_t
    character(len=:), allocatable :: kind       !! 'frequency', 'critical speed', ...
    character(len=:), allocatable :: label      !! what it is of: 'mode 2', 'mode 2, order 4.5'
    character(len=:), allocatable :: unit       !! of the value, in SI; '' of shares
    real(wp) :: value = 0.0_wp
    logical :: is_share = .false.               !! whether it is shown in per cent, and its changes in points of these
    real(wp), allocatable :: derivative(:)      !! by each number, in SI units of both, [keys]
  contains
    procedure :: set
  end type answer_t

  type, abstract, public :: answers_t
    type(answer_t), allocatable :: answers(:)
    integer :: functionals = 0
    real(wp), allocatable :: scale(:)   !! sizes of the terms of each functional, [functionals]
  contains
    procedure(differentiate_interface), deferred :: differentiate_near
    procedure(evaluate_interface), deferred :: evaluate
    procedure(finish_interface), deferred :: finish
  end type answers_t

  !> Answers among others.
  type, public :: answers_group_t
    class(answers_t), pointer :: answers => null()
  end type answers_group_t

  abstract interface

    !> The derivatives of the functionals by a number, with steady states that stay.
    subroutine differentiate_interface(self, number, slopes, is_done, error)
      import :: answers_t, error_t, number_change_t, wp
      class(answers_t), intent(inout) :: self            !! its work space changes
      type(number_change_t), intent(inout) :: number
      real(wp), intent(out) :: slopes(:)                 !! [functionals]
      logical, intent(out) :: is_done                    !! whether it is known how they move
      type(error_t), allocatable, intent(out) :: error   !! the changed machine has another structure
    end subroutine differentiate_interface

    !> The functionals of a changed input, whose steady states are found anew.
    subroutine evaluate_interface(self, number, values, error)
      import :: answers_t, error_t, number_change_t, wp
      class(answers_t), intent(in) :: self
      type(number_change_t), intent(in) :: number
      real(wp), intent(out) :: values(:)                 !! [functionals]
      type(error_t), allocatable, intent(out) :: error   !! the changed machine has none, or another structure
    end subroutine evaluate_interface

    !> Sets the derivatives of the answers.
    subroutine finish_interface(self, slopes)
      import :: answers_t, wp
      class(answers_t), intent(inout) :: self
      real(wp), intent(in) :: slopes(:, :)   !! of the functionals, [functionals, keys]
    end subroutine finish_interface

  end interface

contains

  !> Sets all but the derivatives.
  subroutine set(self, kind, label, unit, value, is_share)
    class(answer_t), intent(inout) :: self
    character(len=*), intent(in) :: kind, label, unit
    real(wp), intent(in) :: value
    logical, intent(in), optional :: is_share   !! no if absent

    self%kind = kind
    self%label = label
    self%unit = unit
    self%value = value
    if (present(is_share)) self%is_share = is_share
  end subroutine set

  !> Differentiates groups of answers by all numbers. A number whose change the machine does not bear has zeros, and a note.
  subroutine differentiate(input, machine, keys, groups, notes, error)
    type(input_t), intent(in) :: input
    type(machine_t), intent(in) :: machine   !! of it
    type(varied_key_t), intent(in) :: keys(:)
    type(answers_group_t), intent(in) :: groups(:)
    type(string_t), allocatable, intent(inout) :: notes(:)
    type(error_t), allocatable, intent(out) :: error   !! of some answers all numbers are such ones
    type :: slopes_by_keys_t
      real(wp), allocatable :: by(:, :)   ! [functionals, keys]
    end type slopes_by_keys_t
    type(slopes_by_keys_t) :: slopes(size(groups))
    type(error_t), allocatable :: own
    type(number_change_t) :: number
    type(string_t), allocatable :: failed(:), rough(:)
    integer :: failures(size(groups)), g, k
    logical :: has_failed, is_any_rough, is_rough
    character(len=:), allocatable :: reason

    number%input = input
    allocate (failed(0), rough(0))
    failures = 0
    do g = 1, size(groups)
      allocate (slopes(g)%by(groups(g)%answers%functionals, size(keys)), source=0.0_wp)
    end do
    do k = 1, size(keys)
      call number%take(keys(k), machine)
      has_failed = .false.
      is_any_rough = .false.
      do g = 1, size(groups)
        call differentiate_by(groups(g)%answers, number, slopes(g)%by(:, k), is_rough, own)
        is_any_rough = is_any_rough .or. is_rough
        if (.not. allocated(own)) cycle
        slopes(g)%by(:, k) = 0.0_wp
        failures(g) = failures(g) + 1
        has_failed = .true.
        reason = own%message
        deallocate (own)
      end do
      if (has_failed) call append(failed, keys(k)%target%path)
      if (is_any_rough) call append(rough, keys(k)%target%path)
    end do
    if (any(failures == size(keys)) .and. size(keys) > 0) then
      call raise(error, exit_failed, 'no number can be changed: ' // reason)
      return
    end if
    if (size(failed) > 0) call append(notes, 'without derivatives by ' // joined(failed, ', ', 4) // ': ' // reason)
    if (size(rough) > 0) call append(notes, 'not smooth within 0.6 % of ' // joined(rough, ', ', 4) // &
                                            ': derivatives by these are averages of that range')
    do g = 1, size(groups)
      call groups(g)%answers%finish(slopes(g)%by)
    end do
  end subroutine differentiate

  !> Differentiates the functionals of a group by one number.
  subroutine differentiate_by(group, number, slopes, is_rough, error)
    class(answers_t), intent(inout) :: group
    type(number_change_t), intent(inout) :: number
    real(wp), intent(out) :: slopes(:)                 !! [functionals]
    logical, intent(out) :: is_rough
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: values(group%functionals, 0:points)
    integer :: p
    logical :: is_done

    is_rough = .false.
    call group%differentiate_near(number, slopes, is_done, error)
    if (allocated(error)) return
    if (.not. is_done) then
      values = 0.0_wp
      if (abs(number%key%weight_here) > 0) call group%evaluate(number, values(:, 0), error)
      do p = 1, points
        if (allocated(error)) exit
        call number%set(number%key%change(p))
        call group%evaluate(number, values(:, p), error)
      end do
      call number%set(0.0_wp)
      if (allocated(error)) return
      slopes = matmul(values(:, 1:), number%key%weight) + number%key%weight_here * values(:, 0)
      is_rough = are_rough(number%key, values, slopes, group%scale)
    end if
    if (.not. all(is_finite(slopes))) call raise(error, exit_failed, 'a derivative is not a finite number')
  end subroutine differentiate_by

  !> Whether differences of the fourth order tell otherwise.
  pure logical function are_rough(key, values, slopes, scale)
    type(varied_key_t), intent(in) :: key
    real(wp), intent(in) :: values(:, 0:)   !! [functionals, 0:points]
    real(wp), intent(in) :: slopes(:)       !! [functionals]
    real(wp), intent(in) :: scale(:)        !! as of `answers_t`
    real(wp), parameter :: tolerance = 1.0e-4_wp, least = 1.0e-7_wp   ! relative
    real(wp) :: lower(size(slopes))

    are_rough = .false.
    if (abs(key%weight_here) > 0) return
    associate (step => key%change(4))
      lower = (8.0_wp * (values(:, 4) - values(:, 3)) - (values(:, 5) - values(:, 2))) / (12.0_wp * step)
      are_rough = any(abs(lower - slopes) > tolerance * abs(slopes) + least * scale / max(abs(key%value), abs(step)))
    end associate
  end function are_rough

end module nocdyn_answers
