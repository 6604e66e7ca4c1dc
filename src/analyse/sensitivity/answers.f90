!> Numbers that analyses answer, and their derivatives by the numbers of a machine.
!>
!> Answers of one kind are a group: it knows some functionals, real numbers that a changed machine gives with the motions of the
!> machine itself, and makes the derivatives of its answers of the derivatives of these.
module nocdyn_answers
  use nocdyn_errors, only: error_t, exit_failed, raise
  use nocdyn_finite, only: is_finite
  use nocdyn_input, only: input_t
  use nocdyn_kinds, only: wp
  use nocdyn_text, only: append, joined, string_t
  use nocdyn_varied_keys, only: points, set_key, varied_key_t
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
    procedure(evaluate_interface), deferred :: evaluate
    procedure(finish_interface), deferred :: finish
  end type answers_t

  abstract interface

    !> The functionals of a changed input.
    subroutine evaluate_interface(self, input, key, point, values, error)
      import :: answers_t, error_t, input_t, varied_key_t, wp
      class(answers_t), intent(in) :: self
      type(input_t), intent(in) :: input                 !! with the number at the point
      type(varied_key_t), intent(in) :: key
      integer, intent(in) :: point
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

  !> Differentiates a group of answers by all numbers. A number whose change the machine does not bear has zeros, and a note.
  subroutine differentiate(input, keys, group, notes, error)
    type(input_t), intent(in) :: input
    type(varied_key_t), intent(in) :: keys(:)
    class(answers_t), intent(inout) :: group
    type(string_t), allocatable, intent(inout) :: notes(:)
    type(error_t), allocatable, intent(out) :: error   !! all numbers are such ones
    type(error_t), allocatable :: own
    type(input_t) :: varied
    type(string_t), allocatable :: failed(:), rough(:)
    real(wp) :: slopes(group%functionals, size(keys)), values(group%functionals, 0:points)
    integer :: k, p
    character(len=:), allocatable :: reason

    varied = input
    allocate (failed(0), rough(0))
    slopes = 0.0_wp
    do k = 1, size(keys)
      values = 0.0_wp
      do p = 0, points
        if (p == 0 .and. .not. abs(keys(k)%weight_here) > 0) cycle
        call set_key(varied, keys(k), p)
        call group%evaluate(varied, keys(k), p, values(:, p), own)
        if (allocated(own)) exit
      end do
      call set_key(varied, keys(k), 0)
      if (.not. allocated(own)) then
        slopes(:, k) = matmul(values(:, 1:), keys(k)%weight) + keys(k)%weight_here * values(:, 0)
        if (.not. all(is_finite(slopes(:, k)))) call raise(own, exit_failed, 'a derivative is not a finite number')
      end if
      if (.not. allocated(own)) then
        if (is_rough(keys(k), values, slopes(:, k), group%scale)) call append(rough, keys(k)%target%path)
        cycle
      end if
      slopes(:, k) = 0.0_wp
      call append(failed, keys(k)%target%path)
      reason = own%message
      deallocate (own)
    end do
    if (size(failed) == size(keys) .and. size(keys) > 0) then
      call raise(error, exit_failed, 'no number can be changed: ' // reason)
      return
    end if
    if (size(failed) > 0) call append_new(notes, 'without derivatives by ' // joined(failed, ', ', 4) // ': ' // reason)
    if (size(rough) > 0) call append_new(notes, 'not smooth within 0.6 % of ' // joined(rough, ', ', 4) // &
                                            ': derivatives by these are averages of that range')
    call group%finish(slopes)
  end subroutine differentiate

  !> Adds a note that is not there.
  subroutine append_new(notes, note)
    type(string_t), allocatable, intent(inout) :: notes(:)
    character(len=*), intent(in) :: note
    integer :: i

    if (.not. any([(notes(i)%text == note, i=1, size(notes))])) call append(notes, note)
  end subroutine append_new

  !> Whether differences of the fourth order tell otherwise.
  pure logical function is_rough(key, values, slopes, scale)
    type(varied_key_t), intent(in) :: key
    real(wp), intent(in) :: values(:, 0:)   !! [functionals, 0:points]
    real(wp), intent(in) :: slopes(:)       !! [functionals]
    real(wp), intent(in) :: scale(:)        !! as of `answers_t`
    real(wp), parameter :: tolerance = 1.0e-4_wp, least = 1.0e-7_wp   ! relative
    real(wp) :: lower(size(slopes))

    is_rough = .false.
    if (abs(key%weight_here) > 0) return
    associate (step => key%change(4))
      lower = (8.0_wp * (values(:, 4) - values(:, 3)) - (values(:, 5) - values(:, 2))) / (12.0_wp * step)
      is_rough = any(abs(lower - slopes) > tolerance * abs(slopes) + least * scale / max(abs(key%value), abs(step)))
    end associate
  end function is_rough

end module nocdyn_answers
