!> Start speeds that are not given follow from those that are, through the gears.
!>
!> The given speeds of a group of geared bodies are taken one after the other, those with the fewest digits first: 100 is meant to
!> the last digit rather than 33.33. A speed that follows from those before it must agree with it within half a unit of its
!> last digit, in rad/s or rpm, and have three digits at least; else the other order is tried. Of the speeds that stay open the
!> sum of the squares is as small as possible, so that they are zero if they can be, and a note names them.
module nocdyn_followed_speeds
  use nocdyn_kinds, only: wp
  use nocdyn_lapack, only: pseudo_inverse
  use nocdyn_machine, only: machine_t
  use nocdyn_text, only: append, quoted, rounded_text, string_t, to_text
  implicit none (type, external)
  private

  public :: collect, follow_speeds, rounding_of

  real(wp), parameter :: rpm = acos(-1.0_wp) / 30.0_wp   ! rad/s
  real(wp), parameter :: rounding = 1.0e-9_wp            ! relative: a combination of speeds, of rows of the complement
  integer, parameter :: most_digits = 15, shown_digits = 10
  integer, parameter :: least_digits = 3   ! of a speed that may be rounded
  integer, parameter :: most_names = 6                   ! in a note

  !> How a speed was written: the decimals that it needs.
  type :: decimal_t
    integer :: digits = 0               !! significant ones
    real(wp) :: last = 0.0_wp           !! value of a unit of the last digit, at most 1 in the unit [rad/s]
    real(wp) :: unit = 1.0_wp           !! 1 rad/s or 1 rpm [rad/s]
  end type decimal_t

  !> Combinations of unknown speeds whose values are known: orthonormal * speeds = value.
  type, public :: known_t
    integer :: count = 0
    real(wp), allocatable :: orthonormal(:, :)   !! [unknowns, unknowns], the first `count` columns
    real(wp), allocatable :: value(:)            !! [rad/s], [unknowns]
  end type known_t

contains

  !> Sets the start speeds of a group of bodies from those that are given. If these contradict each other, nothing is changed.
  subroutine follow_speeds(machine, group, is_given, is_consistent)
    type(machine_t), intent(inout) :: machine
    integer, intent(in) :: group          !! of geared bodies
    logical, intent(in) :: is_given(:)    !! whether a start speed is given, [bodies]
    logical, intent(out) :: is_consistent
    real(wp), allocatable :: complement(:, :), given(:), slack(:)
    type(decimal_t), allocatable :: decimals(:)
    type(known_t) :: known
    integer, allocatable :: order(:)
    integer :: b, i

    associate (bodies => machine%groups(group)%bodies)
      allocate (complement, source=rows_of(machine, bodies))
      allocate (given(size(bodies)), slack(size(bodies)), decimals(size(bodies)))
      do i = 1, size(bodies)
        given(i) = machine%start_speed(1, bodies(i))
        decimals(i) = decimals_of(given(i))
        slack(i) = rounding * abs(given(i)) + rounding_of(given(i))
      end do
      order = [(pack([(b, b=1, size(bodies))], decimals%digits == i .and. is_given(bodies)), i=0, most_digits)]
      call collect(complement, given, slack, order, known, is_consistent)
      if (.not. is_consistent) call collect(complement, given, slack, order(size(order):1:-1), known, is_consistent)
      if (.not. is_consistent) return
      call set_speeds(machine, bodies, complement, known, is_given(bodies), decimals)
    end associate
  end subroutine follow_speeds

  !> The rows of the complement of a group, whose bodies have an entry for each of its coordinates, [bodies, coordinates].
  function rows_of(machine, bodies) result(rows)
    type(machine_t), intent(in) :: machine
    integer, intent(in) :: bodies(:)
    real(wp), allocatable :: rows(:, :)
    integer :: i

    associate (first => machine%coordinates%first)
      allocate (rows(size(bodies), first(bodies(1) + 1) - first(bodies(1))))
      do i = 1, size(bodies)
        rows(i, :) = machine%coordinates%ratio(1, first(bodies(i)):first(bodies(i) + 1) - 1)
      end do
    end associate
  end function rows_of

  !> The decimals that a speed needs in rad/s or in rpm, where they are fewer.
  pure type(decimal_t) function decimals_of(speed) result(decimal)
    real(wp), intent(in) :: speed   !! [rad/s]
    type(decimal_t) :: in_rpm

    decimal = decimals_in(speed, 1.0_wp)
    in_rpm = decimals_in(speed, rpm)
    if (in_rpm%digits < decimal%digits) decimal = in_rpm
  end function decimals_of

  !> The decimals that a speed needs in a unit. The zeros of 100 are digits of which the last one has the value 1.
  pure type(decimal_t) function decimals_in(speed, unit) result(decimal)
    real(wp), intent(in) :: speed, unit   !! [rad/s]
    real(wp), parameter :: conversion = 1.0e-14_wp   ! relative error of a change of the unit
    real(wp), parameter :: smallest = 1.0e-50_wp     ! of which digits are counted
    real(wp) :: scale, x

    decimal%unit = unit
    x = abs(speed / unit)
    if (x <= 0.0_wp) return
    if (x < smallest) decimal%digits = most_digits
    scale = 1.0_wp / smallest
    do while (decimal%digits < most_digits)
      decimal%digits = decimal%digits + 1
      scale = 10.0_wp**(decimal%digits - 1 - floor(log10(x)))
      if (abs(anint(x * scale) - x * scale) <= conversion * x * scale) exit
    end do
    decimal%last = min(1.0_wp, 1.0_wp / scale) * unit
  end function decimals_in

  !> By how much a given speed may be rounded, half a unit of its last digit; 0 if it has too few digits [rad/s].
  pure real(wp) function rounding_of(speed)
    real(wp), intent(in) :: speed   !! [rad/s]
    type(decimal_t) :: decimal

    decimal = decimals_of(speed)
    rounding_of = merge(0.499_wp * decimal%last, 0.0_wp, decimal%digits >= least_digits)
  end function rounding_of

  !> Collects what equations, row * unknowns = value, say of the unknowns, in an order. Those that follow from the ones before
  !> must agree with them.
  subroutine collect(rows, value, slack, order, known, is_consistent)
    real(wp), intent(in) :: rows(:, :)   !! [equations, unknowns]
    real(wp), intent(in) :: value(:)     !! [rad/s], [equations]
    real(wp), intent(in) :: slack(:)     !! by which an equation may disagree [rad/s], [equations]
    integer, intent(in) :: order(:)      !! equations
    type(known_t), intent(out) :: known
    logical, intent(out) :: is_consistent
    real(wp) :: rest, row(size(rows, 2))
    integer :: i, k, pass

    allocate (known%orthonormal(size(row), size(row)), known%value(size(row)))
    is_consistent = .true.
    do i = 1, size(order)
      row = rows(order(i), :)
      rest = value(order(i))
      do pass = 1, 2   ! the second one removes the rounding of the first
        do k = 1, known%count
          associate (part => dot_product(known%orthonormal(:, k), row))
            rest = rest - part * known%value(k)
            row = row - part * known%orthonormal(:, k)
          end associate
        end do
      end do
      if (norm2(row) > rounding * norm2(rows(order(i), :))) then
        known%count = known%count + 1
        known%orthonormal(:, known%count) = row / norm2(row)
        known%value(known%count) = rest / norm2(row)
      else
        is_consistent = is_consistent .and. abs(rest) <= slack(order(i))
      end if
    end do
  end subroutine collect

  !> Sets the start speeds of the bodies of a group, and notes the given ones that are changed.
  subroutine set_speeds(machine, bodies, complement, known, is_given, decimals)
    type(machine_t), intent(inout) :: machine
    integer, intent(in) :: bodies(:)
    real(wp), intent(in) :: complement(:, :)     !! [bodies, coordinates]
    type(known_t), intent(in) :: known
    logical, intent(in) :: is_given(:)           !! [bodies]
    type(decimal_t), intent(in) :: decimals(:)   !! [bodies]
    real(wp) :: free(size(complement, 2), size(complement, 2)), speed(size(bodies))
    type(string_t), allocatable :: changes(:), left_open(:)
    character(len=:), allocatable :: text
    integer :: i, k

    ! projection on the motions that do not change the known combinations, [coordinates, coordinates]
    free = 0.0_wp
    do i = 1, size(free, 1)
      free(i, i) = 1.0_wp
      do k = 1, known%count
        free(:, i) = free(:, i) - known%orthonormal(i, k) * known%orthonormal(:, k)
      end do
    end do
    if (known%count == size(free, 1)) free = 0.0_wp
    speed = matmul(complement, smallest_speeds(complement, known, free))
    allocate (changes(0), left_open(0))
    do i = 1, size(bodies)
      associate (start => machine%start_speed(:, bodies(i)))
        if (is_given(i) .and. abs(speed(i) - start(1)) <= rounding * abs(start(1))) cycle
        if (is_given(i)) then
          call write_speed(start(1), decimals(i), text)
          call append(changes, text // ' of ' // quoted(machine%names(bodies(i))%text) // ' by ' // &
                               rounded_text(speed(i) / decimals(i)%unit, shown_digits))
        end if
        if (norm2(matmul(complement(i, :), free)) > rounding * norm2(complement(i, :)) .and. abs(speed(i)) > 0.0_wp) then
          call append(left_open, quoted(machine%names(bodies(i))%text))
        end if
        start = speed(i)
      end associate
    end do
    if (size(changes) > 0) then
      call join_texts(changes, text)
      call append(machine%start_notes, 'start speeds contradict the gears by no more than their rounding, and are replaced: ' // &
                                       text)
    end if
    if (size(left_open) > 0) then
      call join_texts(left_open, text)
      call append(machine%start_notes, 'the given start speeds do not determine those of ' // text // &
                                       ': the smallest ones that fit are taken')
    end if
  end subroutine set_speeds

  !> Speeds of the coordinates with the known combinations, and the smallest speeds of the bodies [rad/s], [coordinates].
  function smallest_speeds(complement, known, free) result(speeds)
    real(wp), intent(in) :: complement(:, :)   !! [bodies, coordinates]
    type(known_t), intent(in) :: known
    real(wp), intent(in) :: free(:, :)         !! by `free_motions`
    real(wp) :: speeds(size(complement, 2))

    speeds = matmul(known%orthonormal(:, :known%count), known%value(:known%count))
    if (known%count == size(speeds)) return
    speeds = speeds - matmul(free, matmul(pseudo_inverse(matmul(complement, free), rounding), matmul(complement, speeds)))
  end function smallest_speeds

  !> "33.33 rpm".
  subroutine write_speed(speed, decimal, text)
    real(wp), intent(in) :: speed   !! [rad/s]
    type(decimal_t), intent(in) :: decimal
    character(len=:), allocatable, intent(out) :: text

    text = rounded_text(speed / decimal%unit, shown_digits) // ' ' // trim(merge('rad/s', 'rpm  ', decimal%unit >= 1.0_wp))
  end subroutine write_speed

  !> Texts with commas between them, and how many more there are.
  subroutine join_texts(texts, text)
    type(string_t), intent(in) :: texts(:)
    character(len=:), allocatable, intent(out) :: text
    integer :: i

    text = texts(1)%text
    do i = 2, min(size(texts), most_names)
      text = text // ', ' // texts(i)%text
    end do
    if (size(texts) > most_names) text = text // ' and ' // to_text(size(texts) - most_names) // ' more'
  end subroutine join_texts

end module nocdyn_followed_speeds
