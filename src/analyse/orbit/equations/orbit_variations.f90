!> Variations of a periodic motion over one period: the monodromy matrix.
!>
!> The variational equations are linear, their Jacobian is that of the machine along the motion. They are integrated by Gauss
!> collocation of order 12 with even steps, which keeps the size of undamped oscillations; where parts are stiff, a few steps by
!> Radau collocation let decay what decays at once. (E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, IV.5.)
!> The unknowns of a step are the accelerations, and the rates of the internal states, at its stages: blocks along the machine.
module nocdyn_orbit_variations
  use nocdyn_collocation, only: chebyshev_points, collocation_t, gauss_points, interpolation, new_collocation, radau_points, &
    stages
  use nocdyn_elimination, only: node_order_t, new_node_order
  use nocdyn_errors, only: error_t
  use nocdyn_harmonic_basis, only: differentiated
  use nocdyn_kinds, only: wp
  use nocdyn_lapack_eigen, only: eigenvalues
  use nocdyn_orbit_equations, only: orbit_equations_t
  use nocdyn_periodic_machine, only: orbit_t
  implicit none (type, external)
  private

  public :: find_monodromy, states_at, steps_of

  integer, parameter :: nodes = 16             ! of a panel: the Jacobian is interpolated between them
  integer, parameter :: fewest_panels = 6
  real(wp), parameter :: longest = 5.0_wp      ! step times an eigenvalue of the Jacobian
  real(wp), parameter :: longest_gone = 10.0_wp   ! the same of those that are gone after a period: such steps damp 85 % as much
  real(wp), parameter :: tolerated = 1.0e-7_wp ! error of a multiplier
  real(wp), parameter :: error_constant = 1.738e-13_wp   ! of a step: 6!^2 / (12! 13!)
  real(wp), parameter :: most_steps = 5.0e4_wp ! of a panel
  real(wp), parameter :: gone = 25.0_wp        ! e^-gone is left after a period
  real(wp), parameter :: stiff = 10.0_wp       ! step times an eigenvalue that Gauss collocation does not damp enough
  integer, parameter :: damping_steps = 3      ! by Radau collocation, where there are such ones
  real(wp), parameter :: turn = 2.0_wp * acos(-1.0_wp)

  !> The Jacobian along the motion, in panels of even length.
  type :: course_t
    real(wp), allocatable :: slopes(:, :, :)        !! at the nodes, [nodes, positions, panels]
    logical, allocatable :: is_constant(:)          !! [positions]
    integer :: steps = 1                            !! of a panel
    logical :: is_stiff = .false.
  contains
    procedure :: find_slopes
  end type course_t

contains

  !> Derivatives of the state after one period by the state at its begin, [states, states].
  subroutine find_monodromy(equations, orbit, matrix, error)
    type(orbit_equations_t), intent(inout) :: equations
    type(orbit_t), intent(inout) :: orbit
    real(wp), allocatable, intent(out) :: matrix(:, :)
    type(error_t), allocatable, intent(out) :: error
    type(course_t) :: course
    type(node_order_t) :: order
    type(collocation_t) :: gauss, radau
    integer, allocatable :: element(:)
    real(wp), allocatable :: along(:, :), constant(:, :, :), damping(:, :, :), y(:, :)
    real(wp), allocatable :: between(:, :, :)   ! interpolation to the stages of a step, [stages, nodes, steps]
    real(wp) :: weights(stages, nodes)
    integer :: i, k, n, panel, step

    call equations%set_value(orbit, error)
    if (allocated(error)) return
    call find_course(equations, orbit, course)
    associate (panels => size(course%slopes, 3), pairs => equations%row_node > 0)
      gauss = new_collocation(gauss_points(), turn / orbit%rate / (panels * course%steps))
      radau = new_collocation(radau_points(), gauss%h)
      order = new_node_order(equations%nodes, pack(equations%row_node, pairs), pack(equations%column_node, pairs), &
                              [(.false., i=1, equations%nodes)])
      allocate (element(size(equations%row_node)), source=0)
      do k = 1, size(element)
        if (pairs(k)) element(k) = order%element(equations%row_node(k), equations%column_node(k))
      end do
      constant = constant_blocks(equations, course, gauss, order, element)
      damping = constant_blocks(equations, course, radau, order, element)
      n = equations%machine%states
      allocate (y(n, n), source=0.0_wp)
      do i = 1, n
        y(i, i) = 1.0_wp
      end do
      allocate (along(stages, size(element)), between(stages, nodes, course%steps))
      do step = 1, course%steps
        between(:, :, step) = interpolation(chebyshev_points(nodes), (step - 1 + gauss%c / gauss%h) / course%steps)
      end do
      do panel = 1, panels
        do step = 1, course%steps
          if (course%is_stiff .and. panel == 1 .and. step <= damping_steps) then
            weights = interpolation(chebyshev_points(nodes), (step - 1 + radau%c / radau%h) / course%steps)
            call course%find_slopes(weights, panel, along)
            call take_step(equations, order, element, radau, damping, course%is_constant, along, y)
          else
            call course%find_slopes(between(:, :, step), panel, along)
            call take_step(equations, order, element, gauss, constant, course%is_constant, along, y)
          end if
        end do
      end do
    end associate
    matrix = transpose(y)
  end subroutine find_monodromy

  !> The number of steps over a period: many where parts of a machine are stiff and hardly damped.
  integer function steps_of(equations, orbit) result(steps)
    type(orbit_equations_t), intent(inout) :: equations
    type(orbit_t), intent(in) :: orbit
    type(course_t) :: course

    call find_course(equations, orbit, course)
    steps = course%steps * size(course%slopes, 3)
  end function steps_of

  !> The Jacobian along an orbit, and the steps that it asks for.
  subroutine find_course(equations, orbit, course)
    type(orbit_equations_t), intent(inout) :: equations
    type(orbit_t), intent(in) :: orbit
    type(course_t), intent(out) :: course
    integer, parameter :: most_halvings = 3
    real(wp), parameter :: resolved = 1.0e-8_wp   ! the last coefficients of a panel, as a share of the largest slope
    real(wp), allocatable :: all(:, :)
    integer :: halvings, i, panels

    panels = max(fewest_panels, equations%basis%harmonics)
    do halvings = 0, most_halvings
      call sample_slopes(equations, orbit, panels, all)
      if (roughness(all) <= resolved .or. halvings == most_halvings) exit
      panels = 2 * panels
    end do
    allocate (course%is_constant(size(all, 2)))
    do i = 1, size(all, 2)
      course%is_constant(i) = .not. any(abs(all(:, i) - all(1, i)) > 0)
    end do
    call choose_steps(equations, all, turn / orbit%rate, panels, course)
    allocate (course%slopes(nodes, size(all, 2), panels))
    do i = 1, panels
      course%slopes(:, :, i) = all((i - 1) * nodes + 1:i * nodes, :)
    end do
  end subroutine find_course

  !> The largest of the last two Chebyshev coefficients of all panels, each as a share of the largest slope of its position.
  pure real(wp) function roughness(slopes)
    real(wp), intent(in) :: slopes(:, :)   !! at the nodes of all panels, [times, positions]
    real(wp) :: last(nodes, 2), largest
    integer :: i, k

    do k = 1, 2
      last(:, k) = [(2.0_wp / nodes * cos(0.25_wp * turn * (2 * i - 1) * (nodes - k) / nodes), i=1, nodes)]
    end do
    roughness = 0.0_wp
    do k = 1, size(slopes, 2)
      largest = maxval(abs(slopes(:, k)))
      if (.not. any(abs(slopes(:, k) - slopes(1, k)) > 0)) cycle
      do i = 0, size(slopes, 1) - nodes, nodes
        roughness = max(roughness, maxval(abs(matmul(slopes(i + 1:i + nodes, k), last))) / largest)
      end do
    end do
  end function roughness

  !> The Jacobian along an orbit at the nodes of panels.
  subroutine sample_slopes(equations, orbit, panels, all)
    type(orbit_equations_t), intent(inout) :: equations
    type(orbit_t), intent(in) :: orbit
    integer, intent(in) :: panels
    real(wp), allocatable, intent(out) :: all(:, :)   !! [times, positions]
    real(wp) :: t(equations%machine%samples), y(equations%machine%samples, equations%machine%states)
    real(wp) :: part(nodes), slopes(equations%machine%samples, size(equations%machine%pattern%row)), period
    integer :: first, i, total

    period = turn / orbit%rate
    total = panels * nodes
    part = chebyshev_points(nodes)
    allocate (all(total, size(slopes, 2)))
    do first = 0, total - 1, size(t)
      t = [((i / nodes + part(modulo(i, nodes) + 1)) * period / panels, i=first, first + size(t) - 1)]
      call states_at(equations, orbit, t, y)
      call equations%machine%slopes(t, y, slopes)
      associate (last => min(total, first + size(t)))
        all(first + 1:last, :) = slopes(:last - first, :)
      end associate
    end do
  end subroutine sample_slopes

  !> The Jacobian at the stages of a step.
  pure subroutine find_slopes(self, weights, panel, slopes)
    class(course_t), intent(in) :: self
    real(wp), intent(in) :: weights(stages, nodes)
    integer, intent(in) :: panel
    real(wp), intent(out) :: slopes(:, :)   !! [stages, positions]
    integer :: i, k

    do k = 1, size(slopes, 2)
      if (self%is_constant(k)) then
        slopes(:, k) = self%slopes(1, k, 1)
      else
        slopes(:, k) = weights(:, 1) * self%slopes(1, k, panel)
        do i = 2, nodes
          slopes(:, k) = slopes(:, k) + weights(:, i) * self%slopes(i, k, panel)
        end do
      end if
    end do
  end subroutine find_slopes

  !> Steps short enough for all oscillations that are left after a period, by the eigenvalues of a Jacobian with the stiffest
  !> couplings and the mean damping of the motion.
  subroutine choose_steps(equations, slopes, period, panels, course)
    type(orbit_equations_t), intent(in) :: equations
    real(wp), intent(in) :: slopes(:, :)         !! [times, positions]
    real(wp), intent(in) :: period               !! [s]
    integer, intent(in) :: panels
    type(course_t), intent(inout) :: course
    real(wp), allocatable :: matrix(:, :)
    complex(wp), allocatable :: values(:)
    real(wp) :: needed(equations%machine%states)
    logical :: has_failed
    integer :: i

    associate (f => equations%freedoms, n => equations%machine%states, pattern => equations%machine%pattern)
      allocate (matrix(n, n), source=0.0_wp)
      allocate (values(n))
      do i = 1, f
        matrix(f + i, i) = 1.0_wp
      end do
      do i = 1, size(pattern%row)
        if (equations%row_node(i) == 0) cycle
        if (equations%is_speed(i)) then
          matrix(pattern%row(i), pattern%column(i)) = sum(slopes(:, i)) / size(slopes, 1)
        else
          matrix(pattern%row(i), pattern%column(i)) = slopes(maxloc(abs(slopes(:, i)), dim=1), i)
        end if
      end do
    end associate
    call eigenvalues(matrix, values, has_failed)
    if (has_failed) return
    ! n steps change a multiplier by n times the error of a step, constant (|lambda| period / n)^(2 stages + 1)
    associate (turns => abs(values) * period, kept => min(max(values%re * period, -gone), 0.0_wp))
      needed = turns * (turns * (error_constant / tolerated) * exp(kept))**(1.0_wp / (2 * stages))
      where (values%re * period > -gone)
        needed = max(needed, turns / longest)
      else where (abs(values%re) < abs(values%im))
        needed = turns / longest_gone
      else where
        needed = 0.0_wp
      end where
      associate (most => maxval(needed))
        course%steps = max(1, ceiling(min(most / panels, most_steps)))
      end associate
    end associate
    course%is_stiff = maxval(abs(values)) * period / (panels * course%steps) > stiff
    if (course%is_stiff) course%steps = max(course%steps, damping_steps)
  end subroutine choose_steps

  !> One step of all columns of variations.
  subroutine take_step(equations, order, element, rule, constant, is_constant, slopes, y)
    type(orbit_equations_t), intent(in) :: equations
    type(node_order_t), intent(in) :: order
    integer, intent(in) :: element(:)            !! of each position, 0: none
    type(collocation_t), intent(in) :: rule
    real(wp), intent(in) :: constant(:, :, :)    !! blocks by constant slopes
    logical, intent(in) :: is_constant(:)
    real(wp), intent(in) :: slopes(:, :)         !! [stages, positions]
    real(wp), contiguous, intent(inout) :: y(:, :)   !! variations by states, [columns, states]
    real(wp) :: blocks(stages, stages, size(constant, 3)), rates(size(y, 1), stages, equations%nodes)
    real(wp), dimension(size(y, 1), equations%nodes) :: once, twice   ! what constant slopes make of speeds at the begin
    integer :: i, k, n

    blocks = constant
    rates = 0.0_wp
    associate (f => equations%freedoms, row => equations%row_node, column => equations%machine%pattern%column)
      once = 0.0_wp
      twice = 0.0_wp
      do k = 1, size(element)
        if (element(k) == 0) cycle
        if (is_constant(k)) then
          once(:, row(k)) = once(:, row(k)) + slopes(1, k) * y(:, column(k))
          if (column(k) > f .and. column(k) <= 2 * f) twice(:, row(k)) = twice(:, row(k)) + slopes(1, k) * y(:, column(k) - f)
          cycle
        end if
        call add_slopes(equations, k, rule, slopes(:, k), blocks(:, :, element(k)))
        do i = 1, stages
          rates(:, i, row(k)) = rates(:, i, row(k)) + slopes(i, k) * y(:, column(k))
          if (column(k) > f .and. column(k) <= 2 * f) then
            rates(:, i, row(k)) = rates(:, i, row(k)) + (slopes(i, k) * rule%c(i)) * y(:, column(k) - f)
          end if
        end do
      end do
      do n = 1, equations%nodes
        do i = 1, stages
          rates(:, i, n) = rates(:, i, n) + once(:, n) + rule%c(i) * twice(:, n)
        end do
      end do
      call eliminate(order, blocks)
      call substitute(order, size(y, 1), blocks, rates)
      do n = 1, f
        y(:, f + n) = y(:, f + n) + rule%h * y(:, n)
        do i = 1, stages
          y(:, n) = y(:, n) + rule%end_once(i) * rates(:, i, n)
          y(:, f + n) = y(:, f + n) + rule%end_twice(i) * rates(:, i, n)
        end do
      end do
      do n = f + 1, equations%nodes
        do i = 1, stages
          y(:, f + n) = y(:, f + n) + rule%end_once(i) * rates(:, i, n)
        end do
      end do
    end associate
  end subroutine take_step

  !> The blocks of a step by all slopes that are constant.
  function constant_blocks(equations, course, rule, order, element) result(blocks)
    type(orbit_equations_t), intent(in) :: equations
    type(course_t), intent(in) :: course
    type(collocation_t), intent(in) :: rule
    type(node_order_t), intent(in) :: order
    integer, intent(in) :: element(:)
    real(wp) :: blocks(stages, stages, size(order%row))
    integer :: i, k, n

    blocks = 0.0_wp
    do n = 1, equations%nodes
      do i = 1, stages
        blocks(i, i, order%diagonal(n)) = 1.0_wp
      end do
    end do
    do k = 1, size(element)
      if (element(k) == 0 .or. .not. course%is_constant(k)) cycle
      call add_slopes(equations, k, rule, spread(course%slopes(1, k, 1), 1, stages), blocks(:, :, element(k)))
    end do
  end function constant_blocks

  !> Adds to a block what slopes at the stages contribute.
  pure subroutine add_slopes(equations, position, rule, slopes, block)
    type(orbit_equations_t), intent(in) :: equations
    integer, intent(in) :: position
    type(collocation_t), intent(in) :: rule
    real(wp), intent(in) :: slopes(stages)
    real(wp), intent(inout) :: block(stages, stages)
    integer :: j
    logical :: is_angle

    is_angle = equations%column_node(position) <= equations%freedoms .and. .not. equations%is_speed(position)
    do j = 1, stages
      if (is_angle) then
        block(:, j) = block(:, j) - slopes * rule%twice(:, j)
      else
        block(:, j) = block(:, j) - slopes * rule%once(:, j)
      end if
    end do
  end subroutine add_slopes

  !> Factors a matrix of blocks: inverses on the diagonal, factors below it.
  subroutine eliminate(order, blocks)
    type(node_order_t), intent(in) :: order
    real(wp), intent(inout) :: blocks(stages, stages, size(order%row))
    real(wp) :: factor(stages, stages)
    integer :: i, j, k, near

    do k = 1, size(order%pivot)
      associate (first => order%first(k), pivot => order%diagonal(order%pivot(k)))
        call invert(blocks(:, :, pivot))
        near = order%first(k + 1) - first
        do i = 1, near
          factor = product_of(blocks(:, :, order%below(first + i - 1)), blocks(:, :, pivot))
          blocks(:, :, order%below(first + i - 1)) = factor
          do j = 1, near
            associate (changed => order%changed(order%first_changed(k) + i + (j - 1) * near))
              blocks(:, :, changed) = blocks(:, :, changed) - product_of(factor, blocks(:, :, order%beside(first + j - 1)))
            end associate
          end do
        end do
      end associate
    end do
  end subroutine eliminate

  !> Solves with the factors for many columns.
  pure subroutine substitute(order, columns, blocks, x)
    type(node_order_t), intent(in) :: order
    integer, intent(in) :: columns
    real(wp), intent(in) :: blocks(stages, stages, size(order%row))
    real(wp), intent(inout) :: x(columns, stages, order%nodes)   !! right sides, on return solutions
    real(wp) :: right(columns, stages)
    integer :: i, k

    do k = 1, size(order%pivot)
      do i = order%first(k), order%first(k + 1) - 1
        call subtract(columns, blocks(:, :, order%below(i)), x(:, :, order%pivot(k)), x(:, :, order%neighbour(i)))
      end do
    end do
    do k = size(order%pivot), 1, -1
      associate (n => order%pivot(k))
        right = x(:, :, n)
        do i = order%first(k), order%first(k + 1) - 1
          call subtract(columns, blocks(:, :, order%beside(i)), x(:, :, order%neighbour(i)), right)
        end do
        x(:, :, n) = 0.0_wp
        call subtract(columns, -blocks(:, :, order%diagonal(n)), right, x(:, :, n))
      end associate
    end do
  end subroutine substitute

  !> y = y - block x for many columns.
  pure subroutine subtract(columns, block, x, y)
    integer, intent(in) :: columns
    real(wp), intent(in) :: block(stages, stages)
    real(wp), intent(in) :: x(columns, stages)
    real(wp), intent(inout) :: y(columns, stages)
    real(wp) :: rest
    integer :: i, j, k

    do i = 1, stages
      do j = 1, columns
        rest = y(j, i)
        do k = 1, stages
          rest = rest - block(i, k) * x(j, k)
        end do
        y(j, i) = rest
      end do
    end do
  end subroutine subtract

  !> The product of two blocks: loops of a length that is known.
  pure function product_of(a, b) result(c)
    real(wp), intent(in) :: a(stages, stages), b(stages, stages)
    real(wp) :: c(stages, stages)
    integer :: j, k

    do j = 1, stages
      c(:, j) = a(:, 1) * b(1, j)
      do k = 2, stages
        c(:, j) = c(:, j) + a(:, k) * b(k, j)
      end do
    end do
  end function product_of

  !> Inverts a block, by Gauss-Jordan elimination with row interchanges.
  pure subroutine invert(a)
    real(wp), intent(inout) :: a(stages, stages)
    real(wp) :: factor, row(stages)
    integer :: i, k, pivots(stages)

    do k = 1, stages
      pivots(k) = k - 1 + maxloc(abs(a(k:, k)), dim=1)
      row = a(pivots(k), :)
      a(pivots(k), :) = a(k, :)
      factor = 1.0_wp / row(k)
      row(k) = 1.0_wp
      row = row * factor
      a(k, :) = row
      do i = 1, stages
        if (i == k) cycle
        factor = a(i, k)
        a(i, k) = 0.0_wp
        a(i, :) = a(i, :) - factor * row
      end do
    end do
    do k = stages, 1, -1
      row = a(:, k)
      a(:, k) = a(:, pivots(k))
      a(:, pivots(k)) = row
    end do
  end subroutine invert

  !> States of an orbit at some times.
  subroutine states_at(equations, orbit, t, y)
    type(orbit_equations_t), intent(in) :: equations
    type(orbit_t), intent(in) :: orbit
    real(wp), intent(in) :: t(:)              !! [s]
    real(wp), intent(out) :: y(:, :)          !! [times, states]
    real(wp) :: values(size(t), size(orbit%series, 1)), series(size(orbit%series, 1), equations%nodes)
    real(wp) :: cosine(size(t)), sine(size(t)), steady(equations%freedoms)
    integer :: c, k

    values(:, 1) = 1.0_wp
    cosine = cos(orbit%rate * t)
    sine = sin(orbit%rate * t)
    do k = 1, size(values, 2) / 2
      if (k == 1) then
        values(:, 2) = cosine
        values(:, 3) = sine
      else
        values(:, 2 * k) = cosine * values(:, 2 * k - 2) - sine * values(:, 2 * k - 1)
        values(:, 2 * k + 1) = sine * values(:, 2 * k - 2) + cosine * values(:, 2 * k - 1)
      end if
    end do
    series = orbit%series
    series(1, equations%free) = 0.0_wp
    steady = matmul(equations%rigid, orbit%speed)
    associate (f => equations%freedoms)
      y(:, :f) = matmul(values, orbit%rate * differentiated(series(:, :f)))
      y(:, f + 1:) = matmul(values, series)
      do c = 1, f
        y(:, c) = y(:, c) + steady(c)
        y(:, f + c) = y(:, f + c) + steady(c) * t
      end do
    end associate
  end subroutine states_at

end module nocdyn_orbit_variations
