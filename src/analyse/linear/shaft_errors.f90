!> How far the modes of a machine are from the ones of its continuous shafts, whose nodes resolve the lower ones only.
!>
!> In each spectral element the continuous shaft that begins with the angle and moment of the mode ends with others. To first
!> order the square of the frequency is wrong by the work of these differences, angle times moment, over the modal mass (Green's
!> identity for the mode and the one of the continuous shaft).
module nocdyn_shaft_errors
  use nocdyn_kinds, only: wp
  use nocdyn_machine, only: machine_t
  use nocdyn_shafts, only: shaft_element_t, shafts_t
  use nocdyn_spectral_elements, only: new_spectral_element, spectral_element_t
  use nocdyn_text, only: rounded_text
  implicit none (type, external)
  private

  public :: has_shaft_nodes, shaft_error, describe_error

  real(wp), parameter, public :: noted_error = 1.0e-3_wp   !! relative, of a frequency; less is not mentioned
  real(wp), parameter :: vague = 0.03_wp                   ! a larger one is not known to first order

contains

  !> Whether a machine has shafts with inertia.
  pure logical function has_shaft_nodes(machine)
    type(machine_t), intent(in) :: machine
    integer :: i, s

    has_shaft_nodes = .false.
    do i = 1, size(machine%banks)
      select type (bank => machine%banks(i)%bank)
      type is (shafts_t)
        has_shaft_nodes = has_shaft_nodes .or. any([(size(bank%shafts(s)%elements) > 0, s=1, size(bank%shafts))])
      class default
        cycle
      end select
    end do
  end function has_shaft_nodes

  !> About the relative error of the frequency of an undamped mode by the nodes of shafts.
  pure real(wp) function shaft_error(machine, shape, natural) result(error)
    type(machine_t), intent(in) :: machine
    real(wp), intent(in) :: shape(:)   !! angles of all bodies, of any size, [bodies]
    real(wp), intent(in) :: natural    !! frequency [rad/s]
    real(wp) :: work
    integer :: e, i, s

    error = 0.0_wp
    if (.not. natural > 0) return
    work = 0.0_wp
    do i = 1, size(machine%banks)
      select type (bank => machine%banks(i)%bank)
      type is (shafts_t)
        do s = 1, size(bank%shafts)
          do e = 1, size(bank%shafts(s)%elements)
            work = work + work_of_differences(bank%shafts(s)%elements(e), shape, natural)
          end do
        end do
      class default
        cycle
      end select
    end do
    associate (mass => sum(machine%inertia(1, :) * shape**2))
      if (mass > 0) error = 0.5_wp * abs(work) / (natural**2 * mass)
    end associate
  end function shaft_error

  !> In one element.
  pure real(wp) function work_of_differences(element, shape, natural) result(work)
    type(shaft_element_t), intent(in) :: element
    real(wp), intent(in) :: shape(:)
    real(wp), intent(in) :: natural
    type(spectral_element_t) :: spectral
    real(wp) :: angle(0:size(element%bodies) - 1), b, first, last, moment(size(element%bodies) - 1)
    integer :: j

    associate (n => size(element%bodies) - 1, k => element%stiffness)
      spectral = new_spectral_element(n)
      do j = 0, n
        angle(j) = 0.0_wp
        if (element%bodies(j + 1) > 0) angle(j) = shape(element%bodies(j + 1))
      end do
      moment = k * matmul(spectral%row, angle) / spectral%weight
      first = natural**2 * element%inertia * spectral%mass(0) * angle(0) - sum(spectral%row(:, 0) * moment)
      last = sum(spectral%row(:, n) * moment) - natural**2 * element%inertia * spectral%mass(n) * angle(n)
      b = natural * sqrt(element%inertia / k)
      work = angle(n) * (first * cos(b) - k * b * sin(b) * angle(0) - last) &
             - last * (angle(0) * cos(b) + first * sin(b) / (k * b) - angle(n))
    end associate
  end function work_of_differences

  !> "about 0.6 %", "more than 3 %". (No function: threads call it, see `string_t`.)
  subroutine describe_error(error, text)
    real(wp), intent(in) :: error   !! as of `shaft_error`
    character(len=:), allocatable, intent(out) :: text

    if (error > vague) then
      text = 'more than ' // rounded_text(100.0_wp * vague, 2) // ' %'
    else
      text = 'about ' // rounded_text(100.0_wp * error, 1) // ' %'
    end if
  end subroutine describe_error

end module nocdyn_shaft_errors
