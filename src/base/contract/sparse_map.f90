!> Sparse matrices applied to blocks of lanes, row by row: every result is one sum, and nothing is scattered.
!>
!> The terms of a row are added in the order of its entries, in every lane and in each of the loops below, so that the result
!> of a lane has the same bits in a block of any size.
module nocdyn_sparse_map
  use nocdyn_grouping, only: grouped, groups_t
  use nocdyn_kinds, only: wp
  use nocdyn_lane_parameters, only: lane_parameters_t
  implicit none (type, external)
  private

  public :: new_sparse_map, transposed_order

  integer, parameter :: strip = 256   !! rows whose results stay in the first-level cache from diagonal to diagonal

  !> With one lane, consecutive rows whose columns all advance by one from row to row, as the ones of a chain do, form a band:
  !> its entries are stored diagonal by diagonal, and the loop over its rows is a vector loop without indices. A band whose
  !> rows all have the same coefficients is Toeplitz, and only the entries of its first row are stored. All other rows are
  !> stored row by row (CSR). With several lanes all rows are, and the loops over the lanes are the vector loops.
  type, public :: sparse_map_t
    integer, private :: lanes = 1
    integer, private :: all_rows = 0
    integer, private :: columns = 0                      !! number of the last column that has an entry
    integer, private :: csr_rows = 0
    integer, private :: bands = 0
    integer, allocatable, private :: row(:)              !! row of the matrix of each CSR row, [csr_rows]
    integer, allocatable :: first(:)                     !! first entry of each CSR row, [csr_rows + 1]
    integer, allocatable, private :: first_row(:)        !! of each band
    integer, allocatable, private :: rows(:)             !! number of rows of each band
    integer, allocatable, private :: width(:)            !! entries of each row of a band, at least 1
    logical, allocatable, private :: is_toeplitz(:)      !! of each band
    logical, allocatable, private :: has_offset(:)       !! of each band; a Toeplitz band without does not read offsets
    integer, allocatable, private :: first_entry(:)      !! of each band
    integer, allocatable :: column(:)                    !! [entries]
    real(wp), allocatable :: coefficient(:, :)           !! [lanes, entries]
  contains
    procedure :: multiply, multiply_pair, pass_parameters
  end type sparse_map_t

  integer, parameter :: short = 16   !! fewer rows are not worth a vector loop

contains

  !> A map from rows in CSR form: row r has the entries first(r) to first(r + 1) - 1.
  function new_sparse_map(first, column, coefficient, has_offset, without_bands) result(self)
    integer, intent(in) :: first(:)               !! [rows + 1]
    integer, intent(in) :: column(:)              !! [entries]
    real(wp), intent(in) :: coefficient(:, :)     !! [lanes, entries]
    logical, intent(in), optional :: has_offset(:)    !! rows whose offsets in `multiply_pair` may not be zero; absent: all
    logical, intent(in), optional :: without_bands    !! whether all rows are stored as CSR; absent: .false.
    type(sparse_map_t) :: self
    logical :: has_bands
    integer :: order(size(column)), entries, rows, band_rows(size(first) - 1), begin, width, r, s

    rows = size(first) - 1
    self%lanes = size(coefficient, 1)
    has_bands = self%lanes == 1
    if (present(without_bands)) has_bands = has_bands .and. .not. without_bands
    self%all_rows = rows
    self%columns = maxval([0, column])
    allocate (self%row(rows), self%first(rows + 1))
    allocate (self%first_row(rows / short), self%first_entry(rows / short))
    allocate (self%rows(rows / short), self%width(rows / short), self%is_toeplitz(rows / short))
    allocate (self%has_offset(rows / short), source=.true.)
    self%first(1) = 1
    ! number of consecutive rows from each row on whose columns advance by one from row to row
    band_rows = 1
    do r = size(band_rows) - 1, 1, -1
      width = first(r + 1) - first(r)
      if (first(r + 2) - first(r + 1) /= width) cycle
      if (all(column(first(r + 1):first(r + 2) - 1) == column(first(r):first(r + 1) - 1) + 1)) band_rows(r) = band_rows(r + 1) + 1
    end do
    begin = 1
    do while (begin <= self%all_rows)
      width = first(begin + 1) - first(begin)
      if (has_bands .and. width > 0 .and. band_rows(begin) >= short) then
        self%bands = self%bands + 1
        self%first_row(self%bands) = begin
        self%rows(self%bands) = band_rows(begin)
        self%width(self%bands) = width
        self%is_toeplitz(self%bands) = has_constant_diagonals(first(begin), width, band_rows(begin), coefficient)
      else
        call append_csr_rows(first, begin, begin + band_rows(begin) - 1, order, self)
      end if
      begin = begin + band_rows(begin)
    end do
    call append_bands(first, order, entries, self)
    if (present(has_offset)) then
      do s = 1, self%bands
        self%has_offset(s) = any(has_offset(self%first_row(s):self%first_row(s) + self%rows(s) - 1))
      end do
    end if
    allocate (self%column(entries), self%coefficient(self%lanes, entries))
    self%column(:) = column(order(:entries))
    self%coefficient(:, :) = coefficient(:, order(:entries))
  end function new_sparse_map

  !> Whether consecutive rows of equal width have equal coefficients in all lanes.
  pure logical function has_constant_diagonals(first, width, rows, coefficient)
    integer, intent(in) :: first   !! first entry of the first row
    integer, intent(in) :: width   !! entries of each row
    integer, intent(in) :: rows
    real(wp), intent(in) :: coefficient(:, :)   !! [lanes, entries]

    associate (last => first + width * rows - 1)
      has_constant_diagonals = all(.not. abs(coefficient(:, first + width:last) - coefficient(:, first:last - width)) > 0)
    end associate
  end function has_constant_diagonals

  subroutine append_csr_rows(first, begin, end, order, self)
    integer, intent(in) :: first(:), begin, end
    integer, intent(inout) :: order(:)
    type(sparse_map_t), intent(inout) :: self
    integer :: entry, row

    do row = begin, end
      associate (next => self%first(self%csr_rows + 1), entries => first(row + 1) - first(row))
        order(next:next + entries - 1) = [(entry, entry=first(row), first(row + 1) - 1)]
        self%first(self%csr_rows + 2) = next + entries
      end associate
      self%csr_rows = self%csr_rows + 1
      self%row(self%csr_rows) = row
    end do
  end subroutine append_csr_rows

  !> The entries of the bands follow the ones of the CSR rows.
  subroutine append_bands(first, order, entries, self)
    integer, intent(in) :: first(:)
    integer, intent(inout) :: order(:)
    integer, intent(out) :: entries   !! number of entries that are stored
    type(sparse_map_t), intent(inout) :: self
    integer :: i, j, rows, s

    entries = self%first(self%csr_rows + 1) - 1
    do s = 1, self%bands
      self%first_entry(s) = entries + 1
      rows = merge(1, self%rows(s), self%is_toeplitz(s))
      do j = 0, self%width(s) - 1
        order(entries + 1:entries + rows) = [(first(self%first_row(s) + i) + j, i=0, rows - 1)]
        entries = entries + rows
      end do
    end do
  end subroutine append_bands

  !> The transposed structure: the order of entries sorted by column, and the first entry of each column in that order.
  pure subroutine transposed_order(column, columns, order, first)
    integer, intent(in) :: column(:)     !! [entries]
    integer, intent(in) :: columns
    integer, intent(out) :: order(:)     !! [entries]
    integer, intent(out) :: first(:)     !! [columns + 1]
    type(groups_t) :: by_column
    integer :: i

    by_column = grouped(columns, column, [(i, i=1, size(column))])
    order = by_column%member
    first = by_column%start
  end subroutine transposed_order

  !> u = map x.
  subroutine multiply(self, x, u)
    class(sparse_map_t), intent(in) :: self
    real(wp), intent(in) :: x(self%lanes * self%columns)        !! [lanes, columns]
    real(wp), intent(inout) :: u(self%lanes * self%all_rows)    !! [lanes, rows]
    integer :: s

    if (self%lanes > 1) then
      call multiply_lanes(self%lanes, self%all_rows, self%columns, size(self%column), self%first, self%column, &
                          self%coefficient, x, u)
      return
    end if
    call multiply_rows(self%csr_rows, self%all_rows, self%columns, size(self%column), self%row, self%first, self%column, &
                       self%coefficient, x, u)
    do s = 1, self%bands
      associate (entry => self%first_entry(s))
        if (self%is_toeplitz(s)) then
          call multiply_toeplitz(self%rows(s), self%width(s), self%columns, self%column(entry), &
                                     self%coefficient(1, entry), x, u(self%first_row(s)))
        else
          call multiply_band(self%rows(s), self%width(s), self%columns, self%column(entry), self%coefficient(1, entry), &
                                x, u(self%first_row(s)))
        end if
      end associate
    end do
  end subroutine multiply

  !> u = offset + map x and v = map y.
  subroutine multiply_pair(self, offset, x, y, u, v)
    class(sparse_map_t), intent(in) :: self
    real(wp), intent(in) :: offset(self%lanes * self%all_rows)                                  !! [lanes, rows]
    real(wp), intent(in) :: x(self%lanes * self%columns), y(self%lanes * self%columns)          !! [lanes, columns]
    real(wp), intent(inout) :: u(self%lanes * self%all_rows), v(self%lanes * self%all_rows)     !! [lanes, rows]
    integer :: s

    if (self%lanes > 1) then
      call pair_on_lanes(self%lanes, self%all_rows, self%columns, size(self%column), self%first, self%column, &
                         self%coefficient, offset, x, y, u, v)
      return
    end if
    call pair_of_rows(self%csr_rows, self%all_rows, self%columns, size(self%column), self%row, self%first, self%column, &
                      self%coefficient, offset, x, y, u, v)
    do s = 1, self%bands
      associate (entry => self%first_entry(s), row => self%first_row(s))
        if (self%is_toeplitz(s)) then
          call pair_of_toeplitz(self%rows(s), self%width(s), self%columns, self%column(entry), &
                                    self%coefficient(1, entry), .not. self%has_offset(s), offset(row), x, y, u(row), v(row))
        else
          call pair_of_band(self%rows(s), self%width(s), self%columns, self%column(entry), self%coefficient(1, entry), &
                               offset(row), x, y, u(row), v(row))
        end if
      end associate
    end do
  end subroutine multiply_pair

  pure subroutine pair_of_rows(rows, all_rows, columns, entries, row, first, column, coefficient, offset, x, y, u, v)
    integer, intent(in) :: rows, all_rows, columns, entries, row(rows), first(rows + 1), column(entries)
    real(wp), intent(in) :: coefficient(entries), offset(all_rows), x(columns), y(columns)
    real(wp), intent(inout) :: u(all_rows), v(all_rows)
    real(wp) :: sum_of_x, sum_of_y
    integer :: i, k

    do i = 1, rows
      sum_of_x = offset(row(i))
      sum_of_y = 0.0_wp
      do k = first(i), first(i + 1) - 1
        sum_of_x = sum_of_x + coefficient(k) * x(column(k))
        sum_of_y = sum_of_y + coefficient(k) * y(column(k))
      end do
      u(row(i)) = sum_of_x
      v(row(i)) = sum_of_y
    end do
  end subroutine pair_of_rows

  pure subroutine pair_on_lanes(lanes, rows, columns, entries, first, column, coefficient, offset, x, y, u, v)
    integer, intent(in) :: lanes, rows, columns, entries, first(rows + 1), column(entries)
    real(wp), intent(in) :: coefficient(lanes, entries), offset(lanes, rows), x(lanes, columns), y(lanes, columns)
    real(wp), intent(inout) :: u(lanes, rows), v(lanes, rows)
    integer :: c, i, k, l

    do i = 1, rows
      k = first(i)
      if (k == first(i + 1)) then
        u(:, i) = offset(:, i)
        v(:, i) = 0.0_wp
        cycle
      end if
      c = column(k)
      do l = 1, lanes
        u(l, i) = offset(l, i) + coefficient(l, k) * x(l, c)
        v(l, i) = 0.0_wp + coefficient(l, k) * y(l, c)
      end do
      do k = first(i) + 1, first(i + 1) - 1
        c = column(k)
        do l = 1, lanes
          u(l, i) = u(l, i) + coefficient(l, k) * x(l, c)
          v(l, i) = v(l, i) + coefficient(l, k) * y(l, c)
        end do
      end do
    end do
  end subroutine pair_on_lanes

  !> Lists the coefficients; only for a map without bands.
  subroutine pass_parameters(self, parameters)
    class(sparse_map_t), intent(inout) :: self
    type(lane_parameters_t), intent(inout) :: parameters

    if (self%bands > 0) error stop 'nocdyn_sparse_map: parameters in bands cannot be listed'
    call parameters%add_structure(self%first(:self%csr_rows + 1), self%column)
    call parameters%add('map: coefficient', self%coefficient)
  end subroutine pass_parameters

  !> u = A x for rows with coefficients of their own.
  pure subroutine multiply_band(rows, width, columns, column, coefficient, x, u)
    integer, intent(in) :: rows, width, columns, column(rows, width)
    real(wp), intent(in) :: coefficient(rows, width), x(columns)
    real(wp), intent(inout) :: u(rows)
    integer :: begin, c, i, k

    do begin = 1, rows, strip
      c = column(1, 1) - 1
      do i = begin, min(begin + strip - 1, rows)
        u(i) = 0.0_wp + coefficient(i, 1) * x(c + i)
      end do
      do k = 2, width
        c = column(1, k) - 1
        do i = begin, min(begin + strip - 1, rows)
          u(i) = u(i) + coefficient(i, k) * x(c + i)
        end do
      end do
    end do
  end subroutine multiply_band

  !> u = A x for rows with equal coefficients.
  pure subroutine multiply_toeplitz(rows, width, columns, column, coefficient, x, u)
    integer, intent(in) :: rows, width, columns, column(width)
    real(wp), intent(in) :: coefficient(width), x(columns)
    real(wp), intent(inout) :: u(rows)
    real(wp) :: a, b
    integer :: begin, c, d, i, k

    if (width == 2) then   ! of a chain: nothing is read twice
      a = coefficient(1)
      b = coefficient(2)
      c = column(1) - 1
      d = column(2) - 1
      do i = 1, rows
        u(i) = (0.0_wp + a * x(c + i)) + b * x(d + i)
      end do
      return
    end if
    do begin = 1, rows, strip
      c = column(1) - 1
      do i = begin, min(begin + strip - 1, rows)
        u(i) = 0.0_wp + coefficient(1) * x(c + i)
      end do
      do k = 2, width
        c = column(k) - 1
        do i = begin, min(begin + strip - 1, rows)
          u(i) = u(i) + coefficient(k) * x(c + i)
        end do
      end do
    end do
  end subroutine multiply_toeplitz

  !> u = offset + A x and v = A y.
  pure subroutine pair_of_band(rows, width, columns, column, coefficient, offset, x, y, u, v)
    integer, intent(in) :: rows, width, columns, column(rows, width)
    real(wp), intent(in) :: coefficient(rows, width), offset(rows), x(columns), y(columns)
    real(wp), intent(inout) :: u(rows), v(rows)
    integer :: begin, c, i, k

    do begin = 1, rows, strip
      c = column(1, 1) - 1
      do i = begin, min(begin + strip - 1, rows)
        u(i) = offset(i) + coefficient(i, 1) * x(c + i)
        v(i) = 0.0_wp + coefficient(i, 1) * y(c + i)
      end do
      do k = 2, width
        c = column(1, k) - 1
        do i = begin, min(begin + strip - 1, rows)
          u(i) = u(i) + coefficient(i, k) * x(c + i)
          v(i) = v(i) + coefficient(i, k) * y(c + i)
        end do
      end do
    end do
  end subroutine pair_of_band

  !> u = offset + A x and v = A y for rows with equal coefficients.
  pure subroutine pair_of_toeplitz(rows, width, columns, column, coefficient, without_offset, offset, x, y, u, v)
    integer, intent(in) :: rows, width, columns, column(width)
    logical, intent(in) :: without_offset   !! whether `offset` is zero
    real(wp), intent(in) :: coefficient(width), offset(rows), x(columns), y(columns)
    real(wp), intent(inout) :: u(rows), v(rows)
    integer :: begin, c, i, k

    if (width == 2) then
      call pair_of_chain(rows, columns, column, coefficient, without_offset, offset, x, y, u, v)
      return
    end if
    do begin = 1, rows, strip
      c = column(1) - 1
      do i = begin, min(begin + strip - 1, rows)
        u(i) = offset(i) + coefficient(1) * x(c + i)
        v(i) = 0.0_wp + coefficient(1) * y(c + i)
      end do
      do k = 2, width
        c = column(k) - 1
        do i = begin, min(begin + strip - 1, rows)
          u(i) = u(i) + coefficient(k) * x(c + i)
          v(i) = v(i) + coefficient(k) * y(c + i)
        end do
      end do
    end do
  end subroutine pair_of_toeplitz

  !> The pair of products with two diagonals, as in a chain: nothing is read twice.
  pure subroutine pair_of_chain(rows, columns, column, coefficient, without_offset, offset, x, y, u, v)
    integer, intent(in) :: rows, columns, column(2)
    logical, intent(in) :: without_offset   !! whether `offset` is zero
    real(wp), intent(in) :: coefficient(2), offset(rows), x(columns), y(columns)
    real(wp), intent(inout) :: u(rows), v(rows)
    real(wp) :: a, b
    integer :: c, d, i

    a = coefficient(1)
    b = coefficient(2)
    c = column(1) - 1
    d = column(2) - 1
    if (without_offset) then
      do i = 1, rows
        u(i) = (0.0_wp + a * x(c + i)) + b * x(d + i)
        v(i) = (0.0_wp + a * y(c + i)) + b * y(d + i)
      end do
    else
      do i = 1, rows
        u(i) = (offset(i) + a * x(c + i)) + b * x(d + i)
        v(i) = (0.0_wp + a * y(c + i)) + b * y(d + i)
      end do
    end if
  end subroutine pair_of_chain

  !> u = A x in some rows in CSR form, one lane.
  pure subroutine multiply_rows(rows, all_rows, columns, entries, row, first, column, coefficient, x, u)
    integer, intent(in) :: rows, all_rows, columns, entries, row(rows), first(rows + 1), column(entries)
    real(wp), intent(in) :: coefficient(entries), x(columns)
    real(wp), intent(inout) :: u(all_rows)
    real(wp) :: sum
    integer :: i, k

    do i = 1, rows
      sum = 0.0_wp
      do k = first(i), first(i + 1) - 1
        sum = sum + coefficient(k) * x(column(k))
      end do
      u(row(i)) = sum
    end do
  end subroutine multiply_rows

  !> u = A x in every lane, in CSR form.
  pure subroutine multiply_lanes(lanes, rows, columns, entries, first, column, coefficient, x, u)
    integer, intent(in) :: lanes, rows, columns, entries, first(rows + 1), column(entries)
    real(wp), intent(in) :: coefficient(lanes, entries), x(lanes, columns)
    real(wp), intent(inout) :: u(lanes, rows)
    integer :: c, i, k, l

    do i = 1, rows
      k = first(i)
      if (k == first(i + 1)) then
        u(:, i) = 0.0_wp
        cycle
      end if
      c = column(k)
      do l = 1, lanes
        u(l, i) = 0.0_wp + coefficient(l, k) * x(l, c)
      end do
      do k = first(i) + 1, first(i + 1) - 1
        c = column(k)
        do l = 1, lanes
          u(l, i) = u(l, i) + coefficient(l, k) * x(l, c)
        end do
      end do
    end do
  end subroutine multiply_lanes

end module nocdyn_sparse_map
